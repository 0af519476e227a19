#!/bin/bash
# Submits the array that renders, and the job that finishes when it has ended.
#
#   bash submit.sh            all shards; those that are complete end at once
#   bash submit.sh 3,7-9      these shards
#
# Where the dataset stands: `trace dataset status`.
set -eu
# Logs lie beside this script, wherever it is called from.
cd "$(dirname "$0")"
mkdir -p logs
array=$(sbatch --parsable ${1:+--array="$1"} render.sbatch)
# Of several clusters the name stands behind the number.
array=${array%%;*}
# afterany: also when a shard has failed, to say what is missing.
finish=$(sbatch --parsable --dependency="afterany:$array" finish.sbatch)
echo "array $array renders, job ${finish%%;*} finishes; logs in $(pwd)/logs"
