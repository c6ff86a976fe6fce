#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The Python module: against the tool, as a wheel without any registry in an environment of its own, and in the notebooks.
#   python.sh module|wheel|notebooks SOURCE BUILD
source "$(dirname "${BASH_SOURCE[0]}")/../support/skip.sh"
set -euo pipefail
case=$1 source=$(realpath "$2") build=$(realpath "$3")
made=$build/services/python
! grep -q '^CMAKE_CXX_FLAGS:.*sanitize' "$build/CMakeCache.txt" || skip sanitizer "Python has none"
installed "the module, of pybind11 and python3-dev," tests/packages.txt test -e "$(echo "$made"/backwash.*.so)"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
export PYTHONPATH=$made BACKWASH_CACHE= JUPYTER_DATA_DIR=$work JUPYTER_CONFIG_DIR=$work IPYTHONDIR=$work
case $case in
  module) /usr/bin/python3 "$source/tests/python/module.py" "$build/services/backwash" ;;
  wheel)
    unset PYTHONPATH
    installed venv tests/packages.txt /usr/bin/python3 -c 'import ensurepip'
    # --system-site-packages: numpy is Debian's. No index, and none of the places that this machine's settings name.
    /usr/bin/python3 -m venv --system-site-packages own
    export PIP_CONFIG_FILE=/dev/null PIP_NO_INDEX=1 PIP_DISABLE_PIP_VERSION_CHECK=1
    unset PIP_FIND_LINKS
    own/bin/pip wheel -q --no-deps --config-settings "built=$build" -w . "$source/services/python"
    own/bin/pip install -q --no-build-isolation ./backwash-*.whl
    own/bin/python -P - "$source" <<'PYTHON'
import importlib.metadata, pathlib, sys
import backwash, numpy as np
assert pathlib.Path(backwash.__file__).is_relative_to(sys.prefix), backwash.__file__
sigma = backwash.field(backwash.Map("builtin:narrow-gap"), backwash.Model("builtin:quad-5in"))
assert sigma.ndim == 4 and np.isfinite(sigma).any()
assert backwash.__version__.split()[0] == importlib.metadata.version("backwash")
names = {str(f) for f in importlib.metadata.files("backwash")}
assert any(n.endswith("LICENSE") for n in names) and not any(n.startswith("..") for n in names), names
PYTHON
    own/bin/pip check | grep -q "backwash" && failed "pip check: $(own/bin/pip check)"
    own/bin/pip uninstall -q -y backwash
    ! own/bin/python -P -c 'import backwash' 2>/dev/null || failed "something stays behind"
    ;;
  notebooks) /usr/bin/python3 "$source/tests/python/notebooks.py" "$source/docs/notebooks" ;;
esac
