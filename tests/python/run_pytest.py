# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs pytest on a file. Exit code 77: numpy or pytest is absent.

usage: run_pytest.py FILE
"""
import sys

try:
    import numpy  # noqa: F401
    import pytest
except ImportError as error:
    print(f"needs Debian's python3-numpy and python3-pytest: {error}")
    sys.exit(77)
sys.exit(pytest.main(["-q", "-p", "no:cacheprovider", "-W", "error", sys.argv[1]]))
