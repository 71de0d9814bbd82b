// SPDX-License-Identifier: MIT
// mpf-digital-io-server: two servers, for the inputs and the outputs of one digital module. The old
// command was initIpUnidig("module","carrier","site",queueSize,msecPoll,intVec,risingMask,
// fallingMask,biMask,maxClients).
#include <cstdio>
#include <fmt/format.h>
#include <memory>

#include "base/run_main.h"
#include "base/stop_signals.h"
#include "drivers/digital_io/digital_io_model.h"
#include "server/programs/digital_io_server/input_server.h"
#include "server/programs/digital_io_server/output_server.h"
#include "server/programs/digital_io_server/start_options.h"

namespace {

constexpr const char* kProgram = "mpf-digital-io-server";
constexpr int kLines = 32;

// Creates a model and connects its outputs and inputs to their wires.
std::unique_ptr<mpf::DigitalIoModel> makeModel(const mpf::DigitalIoStartOptions& options,
                                               mpf::ModelWires* wires) {
  auto model = std::make_unique<mpf::DigitalIoModel>(
      *options.kind, mpf::wireOutputs(wires, options.place.name, kLines));
  options.inputs.connect(*model, wires);
  return model;
}

void describe(const mpf::DigitalIo& io, const mpf::IndustryPackModule& module,
              const mpf::DigitalIoStartOptions& options, const mpf::ServerLog& log) {
  log->info("{} at {}: polled every {} ms, {}", io.kind().name, module.where(),
            options.io.pollEvery.count(),
            io.usesInterrupts() ? fmt::format("interrupts with vector {}", options.io.vector)
                                : "no interrupts");
  if (options.io.vector != 0 && !io.usesInterrupts())
    log->warn("{} has no interrupts: changes are found by polling", io.kind().name);
  if (options.maxClients != 0)
    log->info("maxclients {} is ignored: any number of clients may monitor the inputs",
              options.maxClients);
}

int serve(int argc, char** argv) {
  mpf::DigitalIoStartOptions options;
  mpf::Hardware hardware;
  if (const auto exit = mpf::parseOrCheck(options, hardware, argc, argv)) return *exit;
  const auto& arguments = options.arguments;
  const auto& name = options.place.name;
  const mpf::ServerLog log(kProgram, arguments.logLevel);
  mpf::DigitalIoModel* model = nullptr;
  auto* const module = hardware.open(
      options.place, mpf::digitalIoModules(),
      [&] {
        auto made = makeModel(options, hardware.wires());
        model = made.get();
        return made;
      },
      log);
  if (module == nullptr) return 0;
  std::unique_ptr<mpf::ModelWireWatcher> watcher;
  if (model != nullptr && hardware.wires() != nullptr)
    watcher =
        std::make_unique<mpf::ModelWireWatcher>(*hardware.wires(), [model] { model->look(); });
  if (options.io.vector != 0) hardware.modules().takeVector(options.io.vector, *module);
  if (options.io.vector != 0) hardware.logPriority(log);
  mpf::DigitalIo io(*module, options.io);
  const auto backplane = mpf::Backplane::attach(arguments.backplane);
  mpf::MessageServer server(backplane, name + "Out", arguments.messages);
  const auto stop = [](void* outputs) noexcept {
    static_cast<mpf::MessageServer*>(outputs)->interrupt();
  };
  // Before the first reply: a client may stop us then.
  const mpf::StopSignals signals(stop, &server);
  mpf::logShortages(server, *log);
  const mpf::DigitalOutputServer outputs(server, io, log);
  mpf::ProgramFailure failure;
  const mpf::DigitalInputServer inputs(backplane, name + "In", arguments.messages, io, log,
                                       [&] { failure.report(); });
  describe(io, *module, options, log);
  log->info(R"(serving "{}" and "{}" at location {})", inputs.getName(), server.getName(),
            server.location());
  server.run();
  log->info("stopped");
  return failure.exitStatus();
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain(kProgram, [&] { return serve(argc, argv); });
}
