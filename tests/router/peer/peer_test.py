# SPDX-License-Identifier: MIT
# Tests the peer in both roles with the real programs:
#   peer_test.py FOLDER-OF-THE-PROGRAMS [arguments of unittest]
from client_role_test import AsClientRouter
from peer_case import main
from server_role_test import AsServerRouter

__all__ = ["AsClientRouter", "AsServerRouter"]

if __name__ == "__main__":
  main()
