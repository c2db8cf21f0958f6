#!/bin/sh
# Runs the command `firefly`, or the tests, of this checkout on a machine that may have nothing but sh:
# installs what is missing, keeps the Python packages in .venv beside this file, then runs.
#
# The locks are made with uv; hatchling and editables are what an editable install is built with:
#   lock="uv pip compile --universal --generate-hashes --no-header --no-annotate --python-version 3.11"
#   printf 'hatchling>=1.27\neditables\n' | $lock pyproject.toml - -o requirements.lock
#   for extra in window measure cluster formats video exr datasets panda3d; do
#       $lock --extra $extra pyproject.toml requirements.lock -o requirements-$extra.lock
#   done
#   extras="--extra window --extra measure --extra cluster --extra formats --extra video --extra exr --extra datasets --extra panda3d"
#   $lock $extras --group test pyproject.toml $(ls requirements*.lock | grep -v test) -o requirements-test.lock
set -eu

script=$(readlink -f -- "$0") # the checkout is where the file is, not where a link to it is
root=$(CDPATH='' cd -- "$(dirname -- "$script")" && pwd -P)
venv=$root/.venv
stamp=$venv/.complete
python=${PYTHON:-python3}

# libc-bin is everywhere, but after an interrupted installation it has yet to make new libraries known.
gl_packages="libc-bin libegl1 libgl1 libgl1-mesa-dri"
test_packages="xvfb xdotool"

say() { printf 'run.sh: %s\n' "$*" >&2; }

die() {
    say "$*"
    exit 1
}

usage() {
    cat <<'END'
Usage: sh run.sh COMMAND [OPTIONS]

  capture     draw the forest and leave pictures on disk
  run         open a window
  test        check style and types, then run the tests; options go to pytest
  COMMAND     any other command of firefly: scenes, plan, measure, doctor, ...

What is missing is installed first: Debian packages, then Python packages into .venv. `run` needs one more
than `capture`; `measure`, --max-error, --max-codes, --budget-ms, --cluster, films (.mp4, .webm), .exr, --dataset
and models such as .dae, .3mf, .step, .bam and .egg need more, and `test` needs most.
sh run.sh COMMAND --help lists a command's options.
END
}

has_python() {
    "$python" -I -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1
}

# Installs those of the Debian packages "$@" that are missing; elsewhere, what lacks is named when it is needed.
need_packages() {
    command -v apt-get >/dev/null || return 0
    if [ -z "${PYTHON-}" ] && ! [ -x "$venv/bin/python" ] && ! has_python; then
        set -- python3 python3-venv "$@"
    fi
    state=" $(dpkg-query -W -f='${Package}=${db:Status-Status} ' "$@" 2>/dev/null || :)"
    missing=
    for package in "$@"; do
        case $state in
        *" $package=installed "*) ;;
        *) missing="$missing $package" ;;
        esac
    done
    [ -n "$missing" ] || return 0

    line="apt-get install -y --no-install-recommends$missing"
    wait="-o DPkg::Lock::Timeout=600" # seconds, for another run.sh or the system's own upgrades
    if [ "$(id -u)" = 0 ]; then
        sudo=
    elif command -v sudo >/dev/null; then
        sudo=sudo
    else
        die "system packages are missing; as root, run: apt-get update && $line"
    fi
    $sudo dpkg --configure -a >/dev/null || say "dpkg --configure -a failed; going on"
    $sudo apt-get update -qq >/dev/null || say "apt-get update failed; trying with the package lists there are"
    size=$($sudo env LC_ALL=C apt-get install --assume-no --no-install-recommends $missing 2>/dev/null |
        sed -n 's/^After this operation, \(.*\) of additional.*/ (\1)/p') || :
    say "installing system packages:$missing$size"
    $sudo env DEBIAN_FRONTEND=noninteractive $line $wait -qq >/dev/null || die "this failed: $line"
}

# What a .venv is made from; it holds absolute paths, so a moved checkout needs a new one.
fingerprint() {
    sum=$(cd "$root" && cat requirements*.lock pyproject.toml | cksum)
    printf '%s %s %s' "$sum" "$("${PYTHON:-$venv/bin/python}" -V 2>/dev/null)" "$root"
}

# The parts of .venv, one a line: its commands, its packages and what says that they are installed.
parts() {
    for part in "$venv"/bin/* "$venv"/lib/*/site-packages/*; do
        case $part in */__pycache__) continue ;; esac
        ! [ -e "$part" ] || printf '%s\n' "${part#"$venv/"}"
    done
}

# True if .venv is finished, has each of the locks "$@", and still has every part that it had when finished; $held are
# the locks that it has.
is_whole() {
    [ -r "$stamp" ] || return 1
    {
        IFS= read -r made && [ "$made" = "$(fingerprint)" ] && IFS= read -r held || return 1
        for lock in "$@"; do
            case " $held " in *" $lock "* | *" test "*) ;; *) return 1 ;; esac
        done
        while IFS= read -r part; do
            [ -e "$venv/$part" ] || return 1
        done
    } <"$stamp"
}

# Waits until no other run.sh changes .venv. The system lets go of the lock when those who hold it end, however
# they end: this process, and a pip that outlives it.
take_turn() {
    [ -w "$root" ] || die "cannot write into $root, where .venv belongs"
    exec 9>>"$root/.venv.lock"
    lock='import fcntl, sys; fcntl.flock(9, fcntl.LOCK_EX | (fcntl.LOCK_NB if "now" in sys.argv else 0))'
    "$python" -I -c "$lock" now 2>/dev/null || {
        say "another run.sh is installing: waiting for it"
        "$python" -I -c "$lock" || die "cannot lock $root/.venv.lock"
    }
}

# -I: neither a module in the working folder nor one in PYTHONPATH is taken for pip or for what is to be installed.
pip_install() {
    "$venv/bin/python" -I -m pip install --quiet --no-compile --disable-pip-version-check --no-input "$@" >&2 ||
        die "the Python packages could not be installed (pip's reason is above); run the same command again"
}

# Installs a lock. That of the tests is large: two pips at once take every second package each. It names all that
# its packages need, so that neither has to look for it.
install_lock() { # FILE
    case $1 in
    *-test.lock) ;;
    *)
        pip_install --require-hashes -r "$1"
        return
        ;;
    esac
    for part in 0 1; do
        awk -v part=$part '/^[^ ]/ { number++ } number % 2 == part' "$1" >"$venv/part-$part.txt"
    done
    pip_install --no-deps --require-hashes -r "$venv/part-1.txt" &
    first=$!
    pip_install --no-deps --require-hashes -r "$venv/part-0.txt"
    wait "$first" || exit 1 # it has said why
    rm -f "$venv/part-0.txt" "$venv/part-1.txt"
}

# What a lock brings; a test holds the figures, to within a fifth.
contents() {
    case $1 in
    base) echo "to draw: numpy, pillow, trimesh, moderngl and others (about 90 MB)" ;;
    window) echo "for a window: glfw (about 1 MB)" ;;
    measure) echo "to measure: embreex, matplotlib, flip-evaluator and others (about 105 MB)" ;;
    cluster) echo "for a cluster: distributed, dask, tornado and others (about 19 MB)" ;;
    formats) echo "to read more model formats: cascadio, lxml, pycollada and others (about 145 MB)" ;;
    video) echo "for films: av (about 104 MB)" ;;
    exr) echo "for OpenEXR: OpenEXR (about 5 MB)" ;;
    datasets) echo "for data sets: pycocotools (about 2 MB)" ;;
    panda3d) echo "to read .bam and .egg: panda3d (about 167 MB)" ;;
    test) echo "to test: panda3d, scipy, mypy and others (about 750 MB, less what is there already)" ;;
    esac
}

# Sees to it that .venv has requirements.lock ("base"), or requirements-NAME.lock for another name; the lock of the
# tests holds all others.
need_venv() { # base | window | measure | cluster | formats | video | exr | datasets | panda3d | test ...
    ! is_whole "$@" || return 0
    has_python || die "needs Python 3.11 or newer with venv; if it is not python3, say which: PYTHON=/path/to/python3 sh run.sh"
    take_turn
    is_whole "$@" || fill_venv "$@" # another run.sh may just have filled it
    exec 9>&-
}

# The stamp goes first and comes last, so that no interrupted .venv has one.
fill_venv() {
    is_whole || held=
    before=$held
    rm -f "$stamp"
    if [ -z "$before" ]; then
        # none yet, one for other locks, one that was interrupted or has lost a part: only a new one is sure to be whole
        say "making .venv"
        "$python" -I -m venv --clear "$venv" >&2 || die "cannot make $venv"
    fi
    for lock in "$@"; do
        case " $held " in *" $lock "*) continue ;; esac
        say "installing Python packages $(contents "$lock")"
        file=$root/requirements-$lock.lock
        [ "$lock" != base ] || file=$root/requirements.lock
        install_lock "$file"
        held="$held $lock"
    done
    # once: while it is replaced, there is no command firefly for others
    [ -n "$before" ] || pip_install --no-deps --no-build-isolation --editable "$root"
    { fingerprint && printf '\n%s\n' "$held" && parts; } >"$stamp.part"
    mv "$stamp.part" "$stamp"
}

run_tests() {
    PATH=$venv/bin:$PATH
    # Compiled code is kept in .venv, also where the environment forbids it beside the sources: without it, every
    # process of the tests would compile the package again.
    unset PYTHONDONTWRITEBYTECODE
    PYTHONPYCACHEPREFIX=$venv/pycache
    # Freed memory of arrays and pictures is kept for the next ones. By default glibc gives each large block back
    # to the system, which then clears its pages anew: a fifth of the processor time of tests that draw.
    MALLOC_MMAP_THRESHOLD_=33554432
    MALLOC_TRIM_THRESHOLD_=536870912
    MALLOC_TOP_PAD_=16777216
    # The threads of a product of matrices wait for the next one without sleeping; here every core has its worker.
    OPENBLAS_NUM_THREADS=1
    export PATH PYTHONPYCACHEPREFIX OPENBLAS_NUM_THREADS
    export MALLOC_MMAP_THRESHOLD_ MALLOC_TRIM_THRESHOLD_ MALLOC_TOP_PAD_
    cd "$root"
    ruff check .
    ruff format --check .
    # types are checked beside the tests; what is found is printed after them
    found=$venv/types.txt
    nice mypy >"$found" 2>&1 &
    types=$!
    trap 'kill "$types" 2>/dev/null || :' EXIT
    # a worker a core, up to four, each with whole files: blocks of a page build on each other; tests/conftest.py has
    # their order
    status=0
    python -m pytest -n auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder "$@" || status=$?
    typed=0
    wait "$types" || typed=$?
    trap - EXIT
    cat "$found"
    [ "$typed" = 0 ] || say "types are wrong: mypy's reasons are above"
    [ "$status" != 0 ] || status=$typed
    exit "$status"
}

case ${1-} in
'' | -h | --help)
    usage
    exit 0
    ;;
test)
    shift
    if has_python; then # Debian's packages and Python's come at the same time
        need_packages $gl_packages $test_packages &
        packages=$!
        need_venv test
        wait "$packages" || exit 1 # it has said why
    else
        need_packages $gl_packages $test_packages
        need_venv test
    fi
    run_tests "$@"
    ;;
*)
    locks=base
    case $1 in
    run) locks="$locks window" ;;
    measure) locks="$locks measure" ;;
    esac
    case " $*" in
    *" --max-error"* | *" --max-codes"* | *" --budget-ms"*) locks="base measure ${locks#base}" ;;
    esac
    case " $*" in
    *" --cluster"*) locks="$locks cluster" ;;
    esac
    case " $* " in
    *.mp4\ * | *.webm\ *) locks="$locks video" ;;
    esac
    case " $*" in
    *.exr* | *" --format"*exr*) locks="$locks exr" ;;
    esac
    case " $*" in
    *" --dataset"*) locks="$locks datasets" ;;
    esac
    case " $* " in # models that need more packages
    *.dae\ * | *.zae\ * | *.3mf\ * | *.3dxml\ * | *.xaml\ * | *.step\ * | *.stp\ * | *.ctm\ *) locks="$locks formats" ;;
    esac
    case " $* " in # of Panda3D
    *.bam[\ ,.]* | *.egg[\ ,.]* | *" measure panda3d "* | *" measure fireflies "*) locks="$locks panda3d" ;;
    esac
    case " $* " in
    *" --help "* | *" -h "*) locks=base ;;
    esac
    need_packages $gl_packages
    need_venv $locks
    exec "$venv/bin/firefly" "$@"
    ;;
esac
