#!/bin/sh
# A study as an array job of Slurm, a part of its runs for each task:
#
#     sbatch --array=1-16 slurm.sh starts.toml 16
#     linkwright study merge out/starts-part-*-of-16
#
# The second number is that of the parts. A task that was killed, or whose node failed, leaves the rows that it has done: the same
# command, or `sbatch --array=3 slurm.sh starts.toml 16` for one part, does what is missing and nothing twice.
#SBATCH --job-name=linkwright
#SBATCH --output=slurm-%A-%a.txt
#SBATCH --open-mode=append
#SBATCH --requeue
#SBATCH --cpus-per-task=1
set -eu
exec linkwright study "$1" --part "$SLURM_ARRAY_TASK_ID/$2" --jobs "${SLURM_CPUS_PER_TASK:-1}" --quiet
