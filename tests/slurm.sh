#!/usr/bin/env bash
# The scripts of farm/slurm on a real Slurm of two nodes on this machine: one render is
# killed by SIGKILL, one task requeued by scontrol; the merged frames have the bits of
# those rendered here. As root: munge, slurmctld and slurmd are started, and stopped at
# the end.
#   tests/slurm.sh [SMITHWALK]
# Exit code 77: skipped, for want of Slurm or of the rights to start it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
smithwalk=$(realpath "${1:-target/debug/smithwalk}")

skip() { printf 'slurm: skipped: %s\n' "$*" && exit 77; }
fail() { printf 'slurm: %s\n' "$*" >&2 && exit 1; }
[[ $(id -u) -eq 0 ]] || skip 'the daemons need root'
for program in slurmctld slurmd sbatch munged; do
    command -v $program > /dev/null || skip "there is no $program; ./setup.sh --with-slurm installs it"
done
[[ -x $smithwalk ]] || fail "there is no $smithwalk: cargo build"

place=$PWD/target/slurm
rm -rf "$place"
mkdir -p "$place"/{state,spool.n1,spool.n2,films}
host=$(hostname -s)
export SLURM_CONF=$place/slurm.conf
cat > "$SLURM_CONF" <<END
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=26817
AuthType=auth/munge
AuthInfo=socket=$place/munge.socket
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$place/state
SlurmdSpoolDir=$place/spool.%n
SlurmctldPidFile=$place/slurmctld.pid
SlurmdPidFile=$place/slurmd.%n.pid
SlurmctldLogFile=$place/slurmctld.log
SlurmdLogFile=$place/slurmd.%n.log
MailProg=/bin/true
SlurmdParameters=config_overrides
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=27001 CPUs=1 RealMemory=2000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=27002 CPUs=1 RealMemory=2000
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
END

stop() {
    local pid
    for pid in "$place"/*.pid; do
        [[ -s $pid ]] && kill "$(cat "$pid")" 2> /dev/null || true
    done
}
trap stop EXIT
# A key and a socket of our own, so that a munge that runs already stays as it is.
head -c 64 /dev/urandom > "$place/munge.key"
chmod 600 "$place/munge.key"
munged --socket="$place/munge.socket" --key-file="$place/munge.key" --pid-file="$place/munged.pid" \
    --seed-file="$place/munge.seed" --log-file="$place/munged.log" --force 2> "$place/munged.err" ||
    skip "munged does not start: $(tail -n 1 "$place/munged.err")"
slurmctld && slurmd -N n1 && slurmd -N n2 || skip 'slurmctld or slurmd does not start'
for ((second = 0; second < 20; second++)); do
    [[ $(sinfo --noheader --Node --format=%T 2> /dev/null | grep -c idle) -eq 2 ]] && break
    sleep 1
done
[[ $second -lt 20 ]] || fail "no idle nodes: see $place/*.log"

# Two frames of a scene in which a lamp moves, each about as long as it takes to be killed.
films=$place/films
cat > "$films/scene.yaml" <<'END'
smithwalk: 1
frames: moves/#.yaml
camera: {projection: {perspective: {fov: 40}}, transform: {look_at: {from: [0, -4, 2], to: [0, 0, 0]}}}
film: {width: 40, height: 30}
sampling: {branches: 1}
world: {constant: {color: 0.2}}
materials: {grey: {diffuse: {color: 0.5}}}
meshes: {floor: {file: floor.obj}}
objects: [{mesh: floor, material: grey}]
lights: [{point: {power: 100, radius: 0.1, transform: {location: [0, 0, 2]}}}]
END
printf 'v -2 -2 0\nv 2 -2 0\nv 2 2 1\nv -2 2 1\nf 1 2 3 4\n' > "$films/floor.obj"
mkdir "$films/moves"
for frame in 3 4; do
    printf 'lights.0.point.transform: {location: [%s, 0, 2]}\n' $((frame - 3)) > "$films/moves/$frame.yaml"
done
spp=${SPP:-12000}

work=$(farm/slurm/submit "$films/scene.yaml" "$films/out_##.exr" --frames 3..4 --parts 2 --spp "$spp" \
    --at-once 2 --smithwalk "$smithwalk" -- --cpus-per-task=1)
job=$(cut -d ' ' -f 1 "$work/jobs")
merges=$(cut -d ' ' -f 2 "$work/jobs")

# The process that renders this part of this frame, once it has saved something.
rendering() {
    local film=$1 second
    for ((second = 0; second < 60; second++)); do
        pgrep -f "^$smithwalk render .*-o $film" && return
        sleep 0.5
    done
    fail "nothing renders $film: see $work/log"
}
first=$(rendering "$work/frame3.part0.film")
second=$(rendering "$work/frame3.part1.film")
sleep 1
# SIGUSR1 saves and goes on, so that there is something to go on from.
kill -USR1 "$first" "$second"
sleep 1
kill -KILL "$first"
scontrol requeue "${job}_1"
farm/slurm/status "$work"

# Requeued tasks wait for two minutes, which is not what is tested.
for ((second = 0; second < 400; second++)); do
    waiting=$(squeue --noheader --array --states=PENDING --jobs="$job" --format='%i %r' 2> /dev/null | awk '$2 == "BeginTime" { print $1 }')
    for task in $waiting; do
        scontrol update JobId="$task" StartTime=now || true
    done
    [[ -n $(squeue --noheader --jobs="$job,$merges" 2> /dev/null) ]] || break
    sleep 1
done
farm/slurm/status "$work"
grep -q 'killed: queued again' "$work/log/0.log" || fail 'the killed task did not queue itself again'
for task in 0 1; do
    grep -q 'resuming at' "$work/log/$task.log" || fail "task $task did not go on from its film: $work/log/$task.log"
done
for frame in 3 4; do
    merged=$films/out_0$frame.exr
    [[ -f $merged ]] || fail "there is no $merged: see $work/log"
    "$smithwalk" render "$films/scene.yaml" --frames $frame..$frame --spp "$spp" -o "$films/alone.exr" > /dev/null
    "$smithwalk" diff "$merged" "$films/alone.exr" --json > "$films/diff.json"
    grep -q '"mse": 0.0,' "$films/diff.json" || fail "frame $frame differs: see $films/diff.json"
done
printf 'slurm: two frames of two parts, a kill and a requeue: the same bits\n'
