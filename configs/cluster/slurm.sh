#!/bin/sh
# A campaign as an array of jobs, eight shards of one core each, then the tables:
#   export EXPERIMENT=configs/experiments/paper_accuracy.yaml OUT=$HOME/results/paper
#   sbatch configs/cluster/slurm.sh
#   VIWO_NO_FASTER_COPY=1 viwo experiment $EXPERIMENT --out $OUT --collect  # when all are done; names what is missing
# A task that is killed and requeued goes on where it was.
#SBATCH --job-name=viwo
#SBATCH --array=0-7
#SBATCH --cpus-per-task=1
#SBATCH --mem=2G
#SBATCH --requeue
set -eu
export VIWO_NO_FASTER_COPY=1  # the same program on nodes with other processors
exec "${VIWO:-viwo}" experiment "$EXPERIMENT" --out "$OUT" --jobs "${SLURM_CPUS_PER_TASK:-1}" \
  --shard SLURM_ARRAY_TASK_ID/SLURM_ARRAY_TASK_COUNT
