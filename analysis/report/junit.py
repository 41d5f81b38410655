"""Claims as JUnit XML, which continuous integration shows: a test case each."""

import re
from collections.abc import Sequence
from xml.etree import ElementTree

from nlctl.annotations import as_annotated

from .document import Claim
from .outline import claim_status

_NO_XML = re.compile("[^\\t\\n\\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@as_annotated
def junit(title: str, claims: Sequence[Claim]) -> bytes:
    """Return claims as JUnit XML.

    A claim that fails or is refuted is a failure, one that is open an error; one of somebody else,
    such as a paper's, that is refuted is skipped, since nothing of ours has failed.  The ids of the
    requirements that it answers stand before its name, and are properties ``requirement``.

    Parameters
    ----------
    title : str
        Of the report: the name of the suite.
    claims : sequence of Claim
        The test cases.

    Returns
    -------
    bytes
        In UTF-8.

    Examples
    --------
    >>> from nlctl.analysis.report import Claim
    >>> claim = Claim(text="|e| <= 0.1", measured="0.2", limit="0.1", holds=False, evidence="")
    >>> print(junit("Arm", [claim]).decode().splitlines()[1])
    <testsuite name="Arm" tests="1" failures="1" errors="0" skipped="0">
    """
    verdicts = [_verdict(claim) for claim in claims]
    count = {what: str(verdicts.count(what)) for what in ("failure", "error", "skipped")}
    suite = ElementTree.Element(
        "testsuite", name=_text(title), tests=str(len(claims)), failures=count["failure"],
        errors=count["error"], skipped=count["skipped"],
    )  # fmt: skip
    for claim, verdict in zip(claims, verdicts, strict=True):
        name = f"{', '.join(claim.ids)}: {claim.text}" if claim.ids else claim.text
        case = ElementTree.SubElement(suite, "testcase", classname=_text(title), name=_text(name))
        if claim.ids:
            known = ElementTree.SubElement(case, "properties")
            for one in claim.ids:
                ElementTree.SubElement(known, "property", name="requirement", value=_text(one))
        evidence = f"{claim_status(claim)[0]}: measured {claim.measured}, limit {claim.limit}"
        if verdict:
            failure = ElementTree.SubElement(case, verdict, message=_text(evidence))
            failure.text = _text(f"evidence: {claim.evidence}") if claim.evidence else None
        else:
            ElementTree.SubElement(case, "system-out").text = _text(evidence)
    ElementTree.indent(suite)
    return ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True) + b"\n"


def _verdict(claim: Claim) -> str:
    """Return the element that says how a claim ended; none where it holds."""
    if claim.holds:
        return ""
    look = claim_status(claim)[1]
    if look == "caution":
        return "error"
    return "skipped" if claim.by else "failure"


def _text(text: str) -> str:
    """Return a text without what XML cannot hold."""
    return _NO_XML.sub("\ufffd", text)
