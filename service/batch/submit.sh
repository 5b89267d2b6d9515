#!/bin/sh
# Hands the batch to Slurm and prints the numbers of its jobs. What sbatch takes besides, such as a partition, can be said in SBATCH_PARTITION and
# the like, or after this script's name.
set -eu
cd {{folder}}
common="--parsable --requeue --open-mode=append --nodes=1 --ntasks=1 {{cpus}}"
{{overture}}
frames=$(sbatch $common {{after_overture}} --array=1-{{parts}} --job-name={{name}}-frames --output=logs/part-%a.log "$@" ./task)
report=$(sbatch $common --dependency=afterany:"${frames%%;*}" --job-name={{name}}-report --output=logs/report.log "$@" ./task report)
echo "overture ${overture:-none} frames $frames report $report"
