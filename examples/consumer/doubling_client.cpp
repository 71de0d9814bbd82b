// SPDX-License-Identifier: MIT
// doubling_client VALUE: sends VALUE to doubling_server, which may start before or after this
// program, and prints the reply.
#include <chrono>
#include <cstdlib>
#include <iostream>

#include <mpf/sync_client.h>

int main(int argc, char** argv) {
  using namespace std::chrono_literals;
  if (argc != 2) {
    std::cerr << "usage: doubling_client VALUE\n";
    return 2;
  }
  mpf::SyncClient client(mpf::Backplane::attach(), "doubler");
  auto answer = client.call(mpf::Int32Message({.value = std::atoi(argv[1])}), 5s);
  const auto reply = answer.as<mpf::Int32>();
  if (!reply) {
    std::cerr << "doubling_client: " << answer.why() << '\n';
    return 1;
  }
  std::cout << (*reply)->value << '\n';
}
