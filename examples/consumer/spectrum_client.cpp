// SPDX-License-Identifier: MIT
// spectrum_client GAIN VALUE...: sends a Spectrum to spectrum_server, and prints the values of the
// reply. Without arguments, sends bytes that are not a Spectrum.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <utility>

#include <mpf/sync_client.h>
#include <mpf/user_message.h>

#include "spectrum.capnp.h"

namespace {

mpf::UserMessage spectrum(double gain, char** values, unsigned count) {
  mpf::UserBuilder builder(mpf::UserMessage::allocValue(64 + count * sizeof(double)));
  auto root = builder.initRoot<Spectrum>();
  root.setGain(gain);
  auto list = root.initValues(count);
  for (unsigned i = 0; i < count; ++i) list.set(i, std::atof(values[i]));
  return std::move(builder).finish();
}

mpf::UserMessage invalid() {
  auto message = mpf::UserMessage::allocValue(100);
  std::ranges::fill(message.value(), std::byte{0xff});
  return message;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace std::chrono_literals;
  mpf::SyncClient client(mpf::Backplane::attach(), "spectrum");
  auto request = argc < 2 ? invalid()
                          : spectrum(std::atof(argv[1]), argv + 2, static_cast<unsigned>(argc - 2));
  auto answer = client.call(std::move(request), 5s);
  const auto reply = answer.as<mpf::User>();
  if (!reply) {
    std::cerr << "spectrum_client: " << answer.why() << '\n';
    return 1;
  }
  mpf::UserReader reader(*reply);
  for (const double value : reader.getRoot<Spectrum>().getValues()) std::cout << value << '\n';
}
