#!/bin/sh
# The tests with the versions of Ubuntu 24.04's apt: Python 3.12, numpy 1.26, setuptools 68.
# Numba, which apt may lack, is the newest that works with that numpy.
# PyBullet has no wheel there: it is built here too, from source. Wants c++ and Python's headers.
set -eu
python=${1:-python3.12}
here=$(cd "$(dirname "$0")/.." && pwd)
folder=$here/build/users-versions

"$python" -c 'import ensurepip, sys; assert sys.version_info[:2] == (3, 12)' 2>/dev/null || {
    echo "$python is no Python 3.12 with venv: make users-versions PYTHON=/path/to/python3.12" >&2
    exit 1
}
pip() { "$folder/venv/bin/python" -m pip --disable-pip-version-check --quiet "$@"; }

echo "Setting up $folder/venv with Ubuntu 24.04's versions"
"$python" -m venv --clear "$folder/venv"
pip install 'setuptools==68.1.2' wheel 'numpy==1.26.4'
pip freeze --all | grep -i '^\(setuptools\|numpy\)==' > "$folder/versions.txt"
printf '%s\n' 'scipy==1.11.4' 'PyYAML==6.0.1' 'jsonschema==4.10.3' 'pytest==7.4.4' \
    >> "$folder/versions.txt"
echo 'Building PyBullet from source: 6 to 9 minutes'
pip install --no-build-isolation --no-cache-dir --no-binary pybullet pybullet
pip install --only-binary :all: --constraint "$folder/versions.txt" PyYAML jsonschema
echo 'Building and installing ragdoll_ros'
# From a copy, since a build leaves its traces; what pip installed is what the tests import.
rm -rf "$folder/source" && mkdir "$folder/source"
(cd "$here" && cp -r setup.py setup.cfg pyproject.toml package.xml config launch resource \
    ragdoll_ros "$folder/source")
pip install --no-build-isolation --constraint "$folder/versions.txt" \
    "$folder/source[ros,report,fit]" pytest
"$folder/venv/bin/python" -m pip list |
    grep -i '^\(numpy\|numba\|llvmlite\|scipy\|setuptools\|pybullet\|pyyaml\|jsonschema\|ragdoll\)'
cd "$here"
export PYTHONSAFEPATH=1 AMENT_PREFIX_PATH="$folder/venv"
"$folder/venv/bin/python" -m ragdoll_ros.physics.kernels
"$folder/venv/bin/python" -m pytest
