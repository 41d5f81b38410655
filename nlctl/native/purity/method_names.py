"""Names of functions and methods: what they do to what they are given."""

from ...expressions.effects import CHANGING as CHANGING
from ...expressions.effects import IN_PLACE as IN_PLACE
from ...expressions.effects import WRITERS as WRITERS

# of tables and columns of pandas, without inplace=True
_OF_COLUMNS = {"abs", "idxmax", "idxmin", "sort_values", "sort_index", "set_index", "reset_index",
               "fillna", "dropna", "cummax", "cummin", "reindex", "to_dict", "iterrows",
               "itertuples"}  # fmt: skip
_OF_TEXTS = {"format", "join", "lower", "upper", "startswith", "endswith", "split", "strip",
             "splitlines", "replace", "lstrip", "rstrip", "rsplit", "rpartition", "removeprefix",
             "removesuffix", "title", "capitalize", "casefold", "swapcase", "zfill", "find",
             "rfind", "isalpha", "isdigit", "isnumeric", "isdecimal", "isalnum", "isspace",
             "isupper", "islower", "isidentifier", "ljust", "rjust"}  # fmt: skip
RECORDING = {"append", "extend", "appendleft", "add", "insert", "setdefault"}  # in histories
# methods that change nothing, of arrays, numbers, texts, dicts and lists
READING = {"all", "any", "argmax", "argmin", "argsort", "astype", "clip", "conj", "conjugate",
           "copy", "cumprod", "cumsum", "dot", "flatten", "item", "max", "mean", "min", "nonzero",
           "prod", "repeat", "round", "searchsorted", "std", "sum", "take", "tolist", "trace",
           "var", "ptp", "is_integer", "bit_length", "as_integer_ratio", "hex", "count", "index",
           "get", "items", "keys", "values", "_asdict", "_replace", "difference", "union",
           "intersection", "isdisjoint", "issubset", "issuperset", "most_common",
           "reduce", "accumulate", "outer", "limit_denominator", *_OF_TEXTS,
           *_OF_COLUMNS}  # fmt: skip
# of sparse matrices, what changes them; of laws of probability; of tables of pandas
OF_SPARSE = ("setdiag", "resize", "sort_indices", "sum_duplicates", "eliminate_zeros", "prune")
OF_LAWS = ("pdf", "logpdf", "cdf", "logcdf", "sf", "logsf", "ppf", "pmf", "logpmf", "isf", "mean",
           "std", "var", "median", "moment", "entropy", "interval", "support")  # fmt: skip
OF_TABLES = ("to_numpy", "tolist", "to_list", "to_dict", "itertuples", "iterrows", "items", "get",
             "keys", "max", "min", "mean", "sum", "head", "tail", "squeeze", "copy",
             "std", "var", "median", "quantile", "idxmax", "idxmin", "set_index", "reindex",
             "asof")  # fmt: skip
# of builtins that return numbers and texts
NUMBERS_AND_TEXTS = {"abs", "all", "any", "bool", "callable", "chr", "complex", "divmod", "float",
                     "format", "hasattr", "hash", "int", "isinstance", "issubclass", "len", "ord",
                     "pow", "range", "repr", "round", "slice", "str", "sum", "bytes", "bin",
                     "hex"}  # fmt: skip
# functions that draw random numbers inside, change settings for everybody, read or write files
DRAWING = ("differential_evolution", "basinhopping", "dual_annealing", "eigs", "eigsh", "svds",
           "lobpcg", "kmeans", "kmeans2", "estimate_rank", "interp_decomp")  # fmt: skip
SETTING = ("seterr", "seterrcall", "setbufsize", "set_printoptions")
OF_FILES = ("save", "savez", "savez_compressed", "savetxt", "load", "loadtxt", "loads", "dump",
            "genfromtxt", "fromregex", "fromfile", "memmap", "breakpoint")  # fmt: skip
