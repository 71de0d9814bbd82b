// SPDX-License-Identifier: MIT
#include <mpf/client/programs/echo_client.h>

namespace {

char letter(int i) { return static_cast<char>('a' + i % 26); }

}  // namespace

int main(int argc, char** argv) {
  return mpf::runEchoClient(
      argc, argv, {"mpf-char8-array-client", "Char8Array", "Char8Array message"}, [](const mpf::EchoOptions& options) {
        return mpf::callEchoServer(
            options,
            [&](int i) {
              auto message = mpf::Char8ArrayMessage::allocValue(options.bytes);
              std::fill(message.value().begin(), message.value().end(), letter(i));
              return message;
            },
            [&](int i, const mpf::Message& reply) {
              const auto value = reply.valueAs<mpf::Char8Array>();
              return value.size() == options.bytes && std::all_of(value.begin(), value.end(), [&](char c) { return c == letter(i); });
            });
      });
}
