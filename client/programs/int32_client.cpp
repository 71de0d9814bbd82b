// SPDX-License-Identifier: MIT
#include <mpf/message_of.h>

#include "client/programs/echo_client.h"

int main(int argc, char** argv) {
  mpf::EchoClient echo{"mpf-int32-client", "Int32", "Int32 message", false, {}, {}};
  echo.make = [](int i, std::size_t) { return mpf::Int32Message({.value = i}); };
  echo.isEcho = [](int i, std::size_t, const mpf::Message& reply) {
    const auto* int32 = reply.tryAs<mpf::Int32>();
    return int32 != nullptr && int32->value == i;
  };
  return mpf::runEchoClient(argc, argv, echo);
}
