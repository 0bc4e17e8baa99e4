-- A row for each run and each study; columns after `text`, the model file, are parts of `entry`, the line of `linkwright runs --json`.
CREATE TABLE runs (
    folder TEXT NOT NULL,
    begun TEXT NOT NULL,
    entry TEXT NOT NULL,
    text TEXT NOT NULL,
    kind TEXT AS (entry ->> '$.kind'),
    model TEXT AS (entry ->> '$.model'),
    method TEXT AS (entry ->> '$.method'),
    status TEXT AS (entry ->> '$.status'),
    fingerprint TEXT AS (entry ->> '$.fingerprint'),
    cycles INTEGER AS (entry ->> '$.result.cycles'),
    analyses INTEGER AS (entry ->> '$.result.analyses'),
    sensitivity_analyses INTEGER AS (entry ->> '$.result.sensitivity_analyses'),
    objective REAL AS (entry ->> '$.result.objective.value'),
    violation_pct REAL AS (entry ->> '$.result.violation_pct'),
    runs INTEGER AS (entry ->> '$.study.runs'),
    done INTEGER AS (entry ->> '$.study.done'),
    failed INTEGER AS (entry ->> '$.study.failed'),
    PRIMARY KEY (folder, begun)
);

-- The rows of studies. `numbers` is a JSON object with a number for each column of the phase.
CREATE TABLE study_rows (
    folder TEXT NOT NULL,
    begun TEXT NOT NULL,
    phase TEXT NOT NULL,
    run INTEGER NOT NULL,
    status TEXT NOT NULL,
    failure TEXT NOT NULL,
    numbers TEXT NOT NULL,
    PRIMARY KEY (folder, begun, phase, run)
) WITHOUT ROWID;

-- Analyses: responses (`request` is empty) or derivatives of a design. `model` is the hash of all that responses depend on, `program` the
-- version of linkwright; `design` and `numbers` are numbers of 8 bytes, the least significant first; `sizes` and `warnings` are JSON.
CREATE TABLE analyses (
    model TEXT NOT NULL,
    program TEXT NOT NULL,
    design BLOB NOT NULL,
    request TEXT NOT NULL,
    sizes TEXT NOT NULL,
    numbers BLOB NOT NULL,
    warnings TEXT NOT NULL,
    hash TEXT NOT NULL,
    PRIMARY KEY (model, program, design, request)
) WITHOUT ROWID;

-- Answers of other programs, as in the file `answers.jsonl` of a run; `head` is its first line. `program` is the hash of the model, of the
-- folder of the program, and of the files that its command names.
CREATE TABLE answers (
    program TEXT NOT NULL,
    head TEXT NOT NULL,
    line TEXT NOT NULL,
    PRIMARY KEY (program, head, line)
) WITHOUT ROWID;
