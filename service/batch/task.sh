#!/bin/sh
# One task of a batch, by its first word: overture, a part's number, report; all does one after the other.
# Frames that are done are not rendered again: a task that was killed is given again as it is.
cd {{directory}} || exit 73
parts={{parts}}
stopped=

run() {
    {{command}} --task "$1" &
    child=$!
    wait "$child"
    code=$?
    if [ "$stopped" ]; then  # it leaves complete frames, and ends in order
        wait "$child"
        code=143
    fi
}

# A process that was killed is followed by another one; a frame that kills the second as well comes last in the third.
task() {
    for try in 1 2 3; do
        run "$1"
        [ "$code" -gt 128 ] && [ "$code" -ne 130 ] && [ "$code" -ne 143 ] || break
    done
    if [ "$code" -eq 80 ]; then code=0; fi  # warnings: the report lists them
}

trap 'stopped=1; kill -TERM "$child" 2>/dev/null' TERM INT
word=${1:-${SLURM_ARRAY_TASK_ID:-all}}
case $word in
    all)
        part=1
        {{overture}}
        while [ "$part" -le "$parts" ] && [ -z "$stopped" ]; do
            task "$part/$parts"
            part=$((part + 1))
        done
        if [ -z "$stopped" ]; then task report; fi
        ;;
    overture) task "overture/$parts" ;;
    report) task report ;;
    *) task "$word/$parts" ;;
esac
# Out of memory: on another machine it may work.
if [ "$code" -eq 75 ] && [ "${SLURM_JOB_ID:-}" ] && [ "${SLURM_RESTART_COUNT:-0}" -eq 0 ]; then
    scontrol requeue "$SLURM_JOB_ID" && sleep 60
fi
exit "$code"
