"""What the page of a study says: captions."""

SPEC = (
    "What is required of every run. A margin is the distance to the bound of a requirement, as a "
    "share of that bound: 0.2 means that 20 % of it are left; a run violates the spec unless the "
    "least of its margins is above 0."
)
SPACE = (
    "What is uncertain: nominal value, law, and the box that corners and searches stay in. "
    "Everything else keeps its nominal value."
)
STATUS = "How the runs ended. A run that did not reach its end violates the spec."
REQUIREMENTS = "Margins by requirement; the spec is the least of them."
METRICS_CAPTION = (
    "Metrics of the runs. Missing: runs that did not reach their end; they are not in the other "
    "columns."
)
MARGINS_CAPTION = (
    "Left: number of runs by margin. Right: share of the runs with at most that margin."
)
VIOLATIONS = " Orange: violations."
PART = (
    "Short studies of what happens when parameters, initial states and disturbances differ from "
    "the paper's. nlctl report STUDY.toml makes a whole report on one, and on longer studies; the "
    "files reports/*.toml of nlctl are such studies."
)
FOUND = "Analyses of the loop, and their results."
SOURCE = "As it was when this page was made:"
