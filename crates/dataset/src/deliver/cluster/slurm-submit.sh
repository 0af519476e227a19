#!/bin/bash
# Submits the array that renders, and the job that finishes the dataset after it.
#
#   bash submit.sh            all shards; complete ones end at once
#   bash submit.sh 3,7-9      these shards
#
# `trace dataset status` shows the progress.
set -eu
# Logs are written beside this script, wherever it is called from.
cd "$(dirname "$0")"
mkdir -p logs
array=$(sbatch --parsable ${1:+--array="$1"} render.sbatch)
# With several clusters, sbatch prints the cluster's name after the number.
array=${array%%;*}
# afterany: runs also if a shard has failed, to list the missing images.
finish=$(sbatch --parsable --dependency="afterany:$array" finish.sbatch)
echo "array $array renders, job ${finish%%;*} finishes; logs in $(pwd)/logs"
