// SPDX-License-Identifier: MIT
#include <mpf/client/programs/echo_client.h>

int main(int argc, char** argv) {
  return mpf::runEchoClient(argc, argv, {"mpf-int32-client", "Int32", "Int32 message"}, [](const mpf::EchoOptions& options) {
    return mpf::callEchoServer(
        options, [](int i) { return mpf::Int32Message({.value = i}); },
        [](int i, const mpf::Message& reply) {
          const auto* echo = reply.tryAs<mpf::Int32>();
          return echo != nullptr && echo->value == i;
        });
  });
}
