# What came out beside what was expected, and the fingerprints of all results.


rule scorecard:
    input:
        [file for name in BOOK for file in PLAN.products(SIZE, name)],
    output:
        "results/scorecard.json",
        "results/scorecard.md",
        report(
            "results/scorecard.html",
            caption="../report/scorecard.rst",
            category="Scorecard",
        ),
    log:
        "logs/scorecard.log",
    params:
        configs=PLAN.configs,
        code=source_hash("studies.scorecard"),
    shell:
        "python -m fsiwork score --configs {params.configs:q} > {log:q} 2>&1"


rule manifest:
    input:
        PLAN.everything(SIZE),
    output:
        "results/{size}/manifest.json",
    log:
        "logs/{size}/manifest.log",
    params:
        configs=PLAN.configs,
    shell:
        "python -m fsiwork manifest --size {wildcards.size:q} --configs {params.configs:q} > {log:q} 2>&1"
