// SPDX-License-Identifier: MIT
// The manual's ip330 server as a program, on a model of the board: main() takes the place of the
// startup file of vxWorks. Arguments: the name of the server, and the signals of the model.
#include <unistd.h>

#include <memory>
#include <utility>

#include <mpf/classic/industry_pack.h>
#include <mpf/drivers/industry_pack/model_carrier.h>

#include "drivers/ip330/ip330_model.h"
#include "drivers/ip330/ip330_signals.h"

extern "C" int initIp330Scan(const char* moduleName, const char* carrierName, const char* siteName,
                             const char* typeString, const char* rangeString, int intVec,
                             int queueSize);

int main(int /*argc*/, char** argv) {
  auto model = std::make_unique<mpf::Ip330Model>();
  for (auto& [channel, signal] : mpf::parseIp330Signals(argv[2])) model->setSignal(channel, signal);
  auto carrier = std::make_unique<mpf::ModelCarrier>();
  carrier->plug("IP_a", std::move(model));
  mpf::classic::addCarrier("ipac", std::move(carrier));

  initIp330Scan(argv[1], "ipac", "IP_a", "D", "-5to5", 120, 20);

  while (true) ::pause();  // the task of the server serves
}
