// SPDX-License-Identifier: MIT
// deferred_client VALUE...: sends all values to deferred_server at once, cancels the requests with
// the value 0, and prints the replies and fates in the order in which they arrive.
#include <cstdlib>
#include <iostream>
#include <span>

#include <mpf/message_client.h>

namespace {

void sendAll(mpf::MessageClient& client, std::span<char*> values) {
  std::int32_t number = 0;
  for (const char* const text : values) {
    mpf::Int32Message request({.value = std::atoi(text)});
    const bool isUnwanted = request->value == 0;
    request.setClientType(++number);  // the reply or the fate has the same number
    std::uint32_t id = 0;
    if (client.send(std::move(request), mpf::Deadline::never(), &id) != mpf::SendResult::sent)
      std::abort();
    if (isUnwanted) client.cancel(id);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::span values(argv + 1, static_cast<std::size_t>(argc - 1));
  auto left = values.size();
  mpf::Dispatcher dispatcher(mpf::Backplane::attach());
  mpf::MessageClient client(dispatcher, [&](mpf::Message&& message) {
    if (const auto* connect = message.tryAs<mpf::Connect>()) {
      if (connect->status == mpf::ConnectStatus::connectYes) sendAll(client, values);
      return;
    }
    std::cout << "request " << message.getClientType();
    if (const auto* reply = message.tryAs<mpf::Int32>()) std::cout << ": " << reply->value << '\n';
    else if (const auto* fate = message.tryAs<mpf::RequestFate>())
      std::cout << ": " << toString(fate->fate) << '\n';
    --left;
  });
  client.bind("worker");

  while (left > 0) dispatcher.runOnce(mpf::Deadline::never());
}
