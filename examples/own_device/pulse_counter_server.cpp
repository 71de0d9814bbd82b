// SPDX-License-Identifier: MIT
// pulse_counter_server [KIND [PARAMETERS]]: serves a pulse counter in site IP_a of a carrier, for
// example "tpci200 0000:03:00.0". Without arguments the module is a model with five pulses at
// input 2.
//
//   Int32 cmd=0 address=channel ──► value = pulses, status 0      cmd=1 clears the channel
//                                   status -1: no such channel or cmd, or the module is absent
#include <exception>
#include <iostream>
#include <memory>
#include <string>

#include <mpf/drivers/industry_pack/create_carrier.h>
#include <mpf/drivers/industry_pack/model_carrier.h>
#include <mpf/message_server.h>

#include "pulse_counter_model.h"

namespace {

enum Command : std::int32_t { kRead = 0, kClear = 1 };

std::unique_ptr<mpf::IndustryPackCarrier> modelCarrier() {
  auto carrier = std::make_unique<mpf::ModelCarrier>();
  auto& counter = carrier->plug("IP_a", std::make_unique<PulseCounterModel>());
  for (int i = 0; i < 5; ++i) counter.pulse(2);
  return carrier;
}

void answer(PulseCounter& counter, mpf::Int32& request) {
  request.status = -1;
  if (request.cmd == kRead) {
    if (const auto count = counter.tryRead(request.address)) {
      request.value = static_cast<std::int32_t>(*count);
      request.status = 0;
    }
  } else if (request.cmd == kClear && counter.tryClear(request.address)) {
    request.status = 0;
  }
}

}  // namespace

int main(int argc, char** argv) try {
  mpf::IndustryPackCarriers carriers;
  carriers.add("ipac",
               argc < 2 ? modelCarrier() : mpf::createCarrier(argv[1], argc > 2 ? argv[2] : ""));
  mpf::IndustryPackModules modules(carriers);
  PulseCounter counter(modules.create("counter", "ipac", "IP_a", PulseCounter::kind()));

  mpf::MessageServer server(mpf::Backplane::attach(), "pulses");
  server.on<mpf::Int32>([&](mpf::Int32& request) { answer(counter, request); });
  return server.runUntilSignal();
} catch (const std::exception& error) {
  std::cerr << "pulse_counter_server: " << error.what() << '\n';
  return 1;
}
