# From datasets to numbers, pictures and tables.


rule measure:
    input:
        PLAN.datasets_of,
    output:
        "results/{size}/checks/{id}.json",
    log:
        "logs/{size}/checks/{id}.log",
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        configs=PLAN.configs,
        checks=PLAN.checks_of,
        code=PLAN.measure_of,
        rows=source_hash("studies.scorecard"),
    shell:
        "NUMBA_NUM_THREADS=1 python -m fsiwork measure {wildcards.id:q} --size {wildcards.size:q}"
        " --configs {params.configs:q} > {log:q} 2>&1"


rule figure:
    input:
        studies=PLAN.datasets_of,
        checks="results/{size}/checks/{id}.json",
    output:
        report(
            "results/{size}/figures/{id}.png",
            caption="../report/artefact.rst",
            category=PLAN.chapter_of,
            subcategory="{size}",
            labels={"artefact": "{id}", "kind": "figure"},
        ),
    log:
        "logs/{size}/figures/{id}.log",
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        configs=PLAN.configs,
        caption=PLAN.caption_of,
        code=PLAN.figure_of,
    shell:
        "NUMBA_NUM_THREADS=1 python -m fsiwork figure {wildcards.id:q} --size {wildcards.size:q}"
        " --configs {params.configs:q} > {log:q} 2>&1"


rule table:
    input:
        studies=PLAN.datasets_of,
        checks="results/{size}/checks/{id}.json",
    output:
        report(
            "results/{size}/tables/{id}.csv",
            caption="../report/artefact.rst",
            category=PLAN.chapter_of,
            subcategory="{size}",
            labels={"artefact": "{id}", "kind": "table"},
        ),
        "results/{size}/tables/{id}.md",
    log:
        "logs/{size}/tables/{id}.log",
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        configs=PLAN.configs,
        caption=PLAN.caption_of,
        code=PLAN.table_of,
    shell:
        "NUMBA_NUM_THREADS=1 python -m fsiwork table {wildcards.id:q} --size {wildcards.size:q}"
        " --configs {params.configs:q} > {log:q} 2>&1"
