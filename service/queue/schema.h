#pragma once

namespace rcs::service {

/// Version of the tables of job_queue.cpp, as the database itself says it.
inline constexpr int kSchema = 1;

// A frame's rank is its priority less the steps of ageing that its submission lies after the epoch: as all that wait
// age alike, an order by it never changes, and old jobs come before newer ones of somewhat higher priority.
inline constexpr const char* kTables = R"sql(
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
)sql";

}  // namespace rcs::service
