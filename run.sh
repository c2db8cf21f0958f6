#!/bin/sh
# Runs the command `firefly`, or the tests, of this checkout on a machine that may have nothing but sh:
# installs what is missing, keeps the Python packages in .venv beside this file, then runs.
#
# The locks are made with uv; hatchling and editables are what an editable install is built with:
#   lock="uv pip compile --universal --generate-hashes --no-header --no-annotate --python-version 3.11"
#   printf 'hatchling>=1.27\neditables\n' | $lock --extra window --extra measure pyproject.toml - -o requirements.lock
#   $lock --extra window --extra measure --group test pyproject.toml requirements.lock -o requirements-test.lock
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
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

What is missing is installed first: Debian packages, then Python packages into .venv.
sh run.sh COMMAND --help lists a command's options.
END
}

has_python() {
    "$python" -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1
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
    if [ "$(id -u)" = 0 ]; then
        sudo=
    elif command -v sudo >/dev/null; then
        sudo=sudo
    else
        die "system packages are missing; as root, run: apt-get update && $line"
    fi
    say "installing system packages:$missing"
    $sudo dpkg --configure -a >/dev/null || say "dpkg --configure -a failed; going on"
    $sudo apt-get update -qq >/dev/null || say "apt-get update failed; trying with the package lists there are"
    $sudo env DEBIAN_FRONTEND=noninteractive $line -qq >/dev/null || die "this failed: $line"
}

# What a complete .venv looks like; it holds absolute paths, so a moved checkout needs a new one.
fingerprint() {
    sum=$(cd "$root" && cat requirements.lock requirements-test.lock pyproject.toml | cksum)
    printf '%s %s %s' "$sum" "$("$venv/bin/python" -V 2>/dev/null)" "$root"
}

pip_install() {
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input "$@" >&2 ||
        die "the Python packages could not be installed (pip's reason is above); run the same command again"
}

# Fills .venv with requirements.lock, or with requirements-test.lock, which has the same and more.
need_venv() { # run | test
    have=$(cat "$stamp" 2>/dev/null || :)
    want=$(fingerprint)
    case $have in
    "test $want") return 0 ;;
    "run $want") [ "$1" = test ] || return 0 ;;
    *)
        # None yet, one for other locks, or one that was interrupted: only a new one is sure to be whole.
        has_python || die "needs Python 3.11 or newer with venv; if it is not python3, say which: PYTHON=/path/to/python3 sh run.sh"
        say "making .venv"
        "$python" -m venv --clear "$venv" >&2 || die "cannot make $venv"
        ;;
    esac

    rm -f "$stamp"
    say "installing Python packages"
    lock=$root/requirements.lock
    [ "$1" = run ] || lock=$root/requirements-test.lock
    pip_install --require-hashes -r "$lock"
    pip_install --no-deps --no-build-isolation --editable "$root"
    printf '%s %s' "$1" "$(fingerprint)" >"$stamp"
}

run_tests() {
    PATH=$venv/bin:$PATH
    export PATH
    cd "$root"
    ruff check .
    ruff format --check .
    mypy
    # a worker a core, up to four, each with whole files: blocks of a page build on each other
    exec python -m pytest -n auto --maxprocesses 4 --dist loadfile "$@"
}

case ${1-} in
'' | -h | --help)
    usage
    exit 0
    ;;
test)
    shift
    need_packages $gl_packages $test_packages
    need_venv test
    run_tests "$@"
    ;;
*)
    need_packages $gl_packages
    need_venv run
    exec "$venv/bin/firefly" "$@"
    ;;
esac
