#!/bin/bash
# Renders, waits until all shards have ended, and finishes the dataset. Removes the jobs of an earlier run first, but not their images.
set -eu
cd "$(dirname "$0")"
kubectl delete job --ignore-not-found @NAME@ @NAME@-finish
kubectl apply -f render.yaml
ended='{.status.conditions[?(@.status=="True")].type}'
# Continues after Failed as well as Complete: the second job lists the missing images.
until kubectl get job @NAME@ -o jsonpath="$ended" | grep -Eq 'Complete|Failed'; do
    sleep 30
done
kubectl apply -f finish.yaml
until kubectl get job @NAME@-finish -o jsonpath="$ended" | grep -Eq 'Complete|Failed'; do
    sleep 10
done
kubectl logs job/@NAME@-finish --all-containers
kubectl get job @NAME@-finish -o jsonpath="$ended" | grep -q Complete
