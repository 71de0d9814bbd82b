// SPDX-License-Identifier: MIT
// doubling_client VALUE: prints twice the value.
#include <cstdlib>
#include <iostream>

#include <mpf/base/clock.h>

int main(int argc, char** argv) {
  if (argc != 2 || mpf::Clock::nowNs() == 0) return 1;
  std::cout << 2 * std::atoi(argv[1]) << '\n';
}
