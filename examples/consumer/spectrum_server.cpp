// SPDX-License-Identifier: MIT
// spectrum_server: replies to a Spectrum, a type of its own, with its values times its gain.
#include <kj/exception.h>
#include <utility>

#include <mpf/message_server.h>
#include <mpf/user_message.h>

#include "spectrum.capnp.h"

namespace {

//   throws  kj::Exception if the request is not a Spectrum
mpf::UserMessage amplified(mpf::MessageServer& server, const mpf::UserMessage& request) {
  // A copy, because this client is not trusted: it can change its message while it is read.
  const auto copy = mpf::UserMessage::tryFrom(request.duplicate()).value();
  mpf::UserReader reader(copy);
  const auto values = reader.getRoot<Spectrum>().getValues();
  const auto gain = reader.getRoot<Spectrum>().getGain();

  const auto bytes = 64 + values.size() * sizeof(double);  // 64: more than all that is not a value
  mpf::UserBuilder builder(server.allocReplyMessage<mpf::User>(request, bytes));
  auto reply = builder.initRoot<Spectrum>();
  reply.setGain(1);
  auto results = reply.initValues(values.size());
  for (unsigned i = 0; i < values.size(); ++i) results.set(i, gain * values[i]);
  return std::move(builder).finish();
}

}  // namespace

int main() {
  mpf::MessageServer server(mpf::Backplane::attach(), "spectrum");
  server.on<mpf::User>([&](mpf::UserMessage&& request) {
    try {
      static_cast<void>(server.reply(amplified(server, request)));
    } catch (const kj::Exception&) {  // otherwise it would end runUntilSignal()
      server.refuse(std::move(request));
    }
  });
  return server.runUntilSignal();
}
