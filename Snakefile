"""config → scene → solver → dataset → study → figure: which file is made from which, and nothing else.

snakemake                        the coarse book            snakemake --config size=book    at the book's sizes
snakemake fig_3_12 table_3_1     single artefacts           snakemake chapter_3             a chapter
"""

import os
import sys
from functools import partial
from shlex import quote

from snakemake.utils import min_version

from fsiwork.sources import source_hash
from fsiwork.targets import Plan

min_version("9.18")
shell.prefix(
    f"PATH={quote(os.path.dirname(sys.executable))}:$PATH; "
)  # the Python that runs this file

SIZE = config.get("size", "coarse")
PLAN = Plan(config.get("configs", "configs"), "results")
BOOK = PLAN.book(SIZE)


wildcard_constraints:
    size=SIZE,
    id=r"[A-Za-z]\w*",
    study=r"[A-Za-z]\w*",
    job=r"[\w.~+-]+",


localrules:
    all,
    book,


rule all:
    default_target: True
    input:
        PLAN.everything(SIZE),
        "results/scorecard.json",
        f"results/{SIZE}/manifest.json",


include: "rules/runs.smk"
include: "rules/artefacts.smk"
include: "rules/scorecard.smk"


rule book:
    input:
        rules.all.input,


for artefact in BOOK:

    rule:
        name:
            artefact
        input:
            PLAN.products(SIZE, artefact),
        localrule: True


for chapter, artefacts in PLAN.chapters(SIZE).items():

    rule:
        name:
            f"chapter_{chapter}"
        input:
            [file for name in artefacts for file in PLAN.products(SIZE, name)],
        localrule: True
