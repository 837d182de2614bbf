# From scenes to datasets: each run is a file, each study is its runs put together.


# Not ancient() where it is used: with that, a changed solver made `all` stop after this rule (Snakemake 9.27).
rule warm_cache:
    output:
        touch("results/{size}/warm_cache.done"),
    log:
        "logs/{size}/warm_cache.log",
    params:
        configs=PLAN.configs,
        core=source_hash(),
    shell:
        "NUMBA_NUM_THREADS=1 python -m fsiwork warm --configs {params.configs:q} --size {wildcards.size:q} > {log:q} 2>&1"


rule run:
    input:
        scene=PLAN.scene_of,
        warm="results/{size}/warm_cache.done",
    output:
        data="results/{size}/runs/{study}/{job}.nc",
        cost="results/{size}/runs/{study}/{job}.cost.json",
    log:
        "logs/{size}/runs/{study}/{job}.log",
    wildcard_constraints:
        study=PLAN.pattern(SIZE, "run"),
    threads: 1
    resources:
        mem_mb=2000,
        runtime=240,
    params:
        options=PLAN.options_of,
        code=PLAN.code_of,
    shell:
        "NUMBA_NUM_THREADS={threads} python -m fsiwork run {input.scene:q} {params.options}"
        " -o {output.data:q} > {log:q} 2>&1"


rule call:
    input:
        scene=PLAN.scene_of,
        warm="results/{size}/warm_cache.done",
    output:
        data="results/{size}/runs/{study}/{job}.json",
        cost="results/{size}/runs/{study}/{job}.cost.json",
    log:
        "logs/{size}/runs/{study}/{job}.log",
    wildcard_constraints:
        study=PLAN.pattern(SIZE, "call"),
        job=r"[\w.~+-]+?",
    threads: 1
    resources:
        mem_mb=2000,
        runtime=240,
    params:
        configs=PLAN.configs,
        definition=PLAN.definition_of,
        code=PLAN.code_of,
    shell:
        "NUMBA_NUM_THREADS={threads} python -m fsiwork study {wildcards.study:q} --job {wildcards.job:q}"
        " --size {wildcards.size:q} --configs {params.configs:q} > {log:q} 2>&1"


# Cheap runs share a process, because starting Python costs a second: one rule a study, which names all runs of a job.
for batched, runs in PLAN.batched(SIZE).items():

    rule:
        name:
            f"batch_{batched}"
        input:
            scene=PLAN.configs / "scenes" / f"{PLAN.study(batched, SIZE).scene}.yaml",
            warm="results/{size}/warm_cache.done",
        output:
            [
                f"results/{{size}}/runs/{batched}/{run}.{ending}"
                for run in runs
                for ending in ("nc", "cost.json")
            ],
        log:
            f"logs/{{size}}/runs/{batched}/{runs[0]}.log",
        threads: 1
        resources:
            mem_mb=2000,
            runtime=240,
        params:
            study=batched,
            job=PLAN.job_of,
            configs=PLAN.configs,
            definition=partial(PLAN.definition_of, study=batched),
            code=partial(PLAN.code_of, study=batched),
        shell:
            "NUMBA_NUM_THREADS={threads} python -m fsiwork study {params.study:q} --job {params.job:q}"
            " --size {wildcards.size:q} --configs {params.configs:q} > {log:q} 2>&1"


rule join:
    input:
        PLAN.jobs_of,
    output:
        data="results/{size}/studies/{study}.nc",
        cost="results/{size}/studies/{study}.cost.json",
    log:
        "logs/{size}/studies/{study}.log",
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        configs=PLAN.configs,
        points=PLAN.points_of,
        code=source_hash("studies.jobs", "joining"),
    shell:
        "NUMBA_NUM_THREADS=1 python -m fsiwork join {wildcards.study:q} --size {wildcards.size:q}"
        " --configs {params.configs:q} > {log:q} 2>&1"
