#!/usr/bin/env bash
# All tests of kerfem. Needs cargo and Python 3.11 or later with pip; stops at the first failure.
#
#   ./test.sh
#
# 1. the tests of all crates, which build the command too, 2. its results, read and recomputed in Python (packages are
# installed into .venv). KERFEM_REQUIRE_SHARED=1 turns a check that is skipped because ../shared is absent into a failure.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

step() { printf '\n== %s\n' "$*"; }

step "cargo test --workspace"
cargo test --workspace

step "Python packages of validation/requirements.txt in .venv"
python="${PYTHON:-python3}"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "$("$python" --version) is too old: Python 3.11 or later is needed (PYTHON=... chooses one)" >&2; exit 1; }
if [ ! -x .venv/bin/python ]; then
    "$python" -m venv --without-pip .venv
fi
# the pip of the Python at hand: some systems cannot put one into a new environment
"$python" -m pip --python .venv/bin/python install --quiet --disable-pip-version-check -r validation/requirements.txt

step "validation/check_results.py"
.venv/bin/python validation/check_results.py "${CARGO_TARGET_DIR:-target}/debug/kerfem"

step "all passed"
