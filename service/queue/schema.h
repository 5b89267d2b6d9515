#pragma once

namespace rcs::service {

// Each step makes the tables of the next version, which the database itself says, from those of the last one.
//
// A frame's rank is its priority less the steps of ageing that its submission lies after the epoch, by the queue's own
// clock: as all that wait age alike, an order by it never changes, and old jobs come before newer ones of somewhat
// higher priority.
inline constexpr const char* kSchemaSteps[] = {
    R"sql(
CREATE TABLE jobs (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    owner TEXT NOT NULL,
    key TEXT,
    digest BLOB NOT NULL,
    spec BLOB NOT NULL,
    scene TEXT NOT NULL,
    scene_key TEXT NOT NULL,
    priority INTEGER NOT NULL,
    state INTEGER NOT NULL,
    submitted INTEGER NOT NULL,
    started INTEGER NOT NULL DEFAULT 0,
    finished INTEGER NOT NULL DEFAULT 0,
    frames INTEGER NOT NULL,
    completed INTEGER NOT NULL DEFAULT 0,
    failed INTEGER NOT NULL DEFAULT 0,
    active INTEGER NOT NULL DEFAULT 0,
    error_code INTEGER NOT NULL DEFAULT 0,
    error TEXT NOT NULL DEFAULT '',
    UNIQUE (owner, key)
);
CREATE INDEX jobs_by_state ON jobs (state);
CREATE TABLE frames (
    job INTEGER NOT NULL REFERENCES jobs (id),
    idx INTEGER NOT NULL,
    number INTEGER NOT NULL,
    spec BLOB NOT NULL,
    state INTEGER NOT NULL,
    rank REAL NOT NULL,
    not_before INTEGER NOT NULL DEFAULT 0,
    starts INTEGER NOT NULL DEFAULT 0,
    tries INTEGER NOT NULL DEFAULT 0,
    deaths INTEGER NOT NULL DEFAULT 0,
    started INTEGER NOT NULL DEFAULT 0,
    finished INTEGER NOT NULL DEFAULT 0,
    error_code INTEGER NOT NULL DEFAULT 0,
    error TEXT NOT NULL DEFAULT '',
    folder TEXT NOT NULL DEFAULT '',
    estimate REAL NOT NULL DEFAULT 0,
    stats TEXT NOT NULL DEFAULT '',
    warnings TEXT NOT NULL DEFAULT '',
    PRIMARY KEY (job, idx)
) WITHOUT ROWID;
CREATE INDEX frames_waiting ON frames (rank DESC, job, idx) WHERE state IN (1, 3);
CREATE INDEX frames_active ON frames (state) WHERE state = 2;
CREATE UNIQUE INDEX frames_by_number ON frames (job, number);
CREATE TABLE files (
    job INTEGER NOT NULL,
    idx INTEGER NOT NULL,
    name TEXT NOT NULL,
    size INTEGER NOT NULL,
    sha256 BLOB NOT NULL,
    PRIMARY KEY (job, idx, name)
) WITHOUT ROWID;
CREATE TABLE job_blobs (
    job INTEGER NOT NULL,
    digest BLOB NOT NULL,
    PRIMARY KEY (job, digest)
) WITHOUT ROWID;
)sql",
    // `ended` is by the queue's clock, which `meta` keeps; submitted, started and finished are to be shown.
    R"sql(
ALTER TABLE jobs ADD COLUMN cancelled INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN ended INTEGER NOT NULL DEFAULT 0;
CREATE INDEX jobs_ended ON jobs (ended, id) WHERE ended > 0;
CREATE INDEX frames_retried ON frames (not_before) WHERE state = 3;
CREATE TABLE labels (
    job INTEGER NOT NULL,
    name TEXT NOT NULL,
    value TEXT NOT NULL,
    PRIMARY KEY (job, name)
) WITHOUT ROWID;
CREATE TABLE meta (
    name TEXT PRIMARY KEY,
    value NOT NULL
) WITHOUT ROWID;
)sql"};
inline constexpr int kSchema = sizeof kSchemaSteps / sizeof kSchemaSteps[0];

}  // namespace rcs::service
