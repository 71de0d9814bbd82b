// SPDX-License-Identifier: MIT
#include <algorithm>

#include <mpf/message_of.h>

#include "client/programs/echo_client.h"

namespace {

char letter(int i) { return static_cast<char>('a' + i % 26); }

}  // namespace

int main(int argc, char** argv) {
  mpf::EchoClient echo{"mpf-char8-array-client", "Char8Array", "Char8Array message", true, {}, {}};
  echo.make = [](int i, std::size_t bytes) {
    auto message = mpf::Char8ArrayMessage::allocValue(bytes);
    std::ranges::fill(message.value(), letter(i));
    return message;
  };
  echo.isEcho = [](int i, std::size_t bytes, const mpf::Message& reply) {
    const auto value = reply.valueAs<mpf::Char8Array>();
    return value.size() == bytes &&
           std::ranges::all_of(value, [i](char c) { return c == letter(i); });
  };
  return mpf::runEchoClient(argc, argv, echo);
}
