#!/bin/bash
# make_packages.sh [ARGUMENT OF CPACK...]
# The Debian packages of this machine's release, in build-package: installs what building takes, builds
# for any machine of the architecture, packs. docs/packages.md says what they are.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
scripts/install_dependencies.sh --packages
cmake --preset package
cmake --build --preset package
cd build-package
rm -f ./*.deb
cpack "$@"
