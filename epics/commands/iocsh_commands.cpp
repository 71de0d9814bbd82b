// SPDX-License-Identifier: MIT
// Commands of the IOC shell: reports, and the client side of the startup files of the original
// MPF (manual, "Using MPF in Applications").
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <epicsExport.h>
#include <epicsStdio.h>
#include <errlog.h>
#include <fmt/format.h>
#include <iocsh.h>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "epics/commands/child_program.h"
#include "epics/commands/router_processes.h"
#include "epics/gpib_links.h"

namespace mpf {
namespace {

// Runs `mpf` and prints its output where the shell prints, perhaps into a file.
void runMpf(const std::vector<std::string>& arguments) try {
  std::array<int, 2> ends{};
  checkCall(::pipe2(ends.data(), O_CLOEXEC), "pipe2");
  const FileDescriptor fromProgram(ends[0]);
  FileDescriptor toIoc(ends[1]);
  ChildProgram program("mpf", arguments, toIoc.get());
  toIoc.reset();
  std::array<char, 4096> text{};
  for (ssize_t got = 1; got > 0;) {
    got = retryInterrupted([&] { return ::read(fromProgram.get(), text.data(), text.size()); });
    epicsStdoutPrintf("%.*s", static_cast<int>(std::max<ssize_t>(got, 0)), text.data());
  }
  constexpr int kNotFound = 127;
  const int status = program.wait();
  if (status == kNotFound)
    errlogPrintf("mpf: not found beside this library or in PATH: install MPF\n");
  iocshSetError(status);
} catch (const std::exception& error) {
  errlogPrintf("mpf: %s\n", error.what());
  iocshSetError(-1);
}

// The arguments of a command with iocshArgArgv, after `before`.
std::vector<std::string> argumentsOf(const iocshArgBuf* values, std::vector<std::string> before) {
  for (int at = 1; at < values[0].aval.ac; ++at) before.emplace_back(values[0].aval.av[at]);
  return before;
}

std::string textOf(const char* text) { return text == nullptr ? "" : text; }

// tcpMessageRouterClientStart(location, port, "address", bufSize, queueSize, "options")
void connectRouter(const iocshArgBuf* values) {
  const auto location = values[0].ival;
  const auto port = values[1].ival;
  const auto host = textOf(values[2].sval);
  if (host.empty() || port < 1 || port > 65535) {
    errlogPrintf(
        "tcpMessageRouterClientStart: write location, port (1 to 65535), \"host\"[, buffer size, "
        "queue size[, \"options of mpf-router\"]]\n");
    iocshSetError(-1);
    return;
  }
  std::istringstream words(textOf(values[5].sval));
  const std::vector<std::string> options{std::istream_iterator<std::string>(words), {}};
  RouterProcesses::instance().connect(location, fmt::format("{}:{}", host, port), options);
}

// HiDEOSGpibLinkConfig(link, location, "server")
void configureGpibLink(const iocshArgBuf* values) try {
  GpibLinks::instance().add(values[0].ival, {values[1].ival, textOf(values[2].sval)});
} catch (const std::invalid_argument& error) {
  errlogPrintf("HiDEOSGpibLinkConfig: %s\n", error.what());
  iocshSetError(-1);
}

iocshArg anything{"arguments", iocshArgArgv};
iocshArg location{"location", iocshArgInt};
iocshArg port{"port", iocshArgInt};
iocshArg address{"host", iocshArgString};
iocshArg bufferSize{"bufSize (ignored)", iocshArgInt};
iocshArg queueSize{"queueSize (ignored)", iocshArgInt};
iocshArg routerOptions{"options of mpf-router (default: --plain)", iocshArgString};

iocshArg gpibLink{"GPIB link", iocshArgInt};
iocshArg gpibServer{"server", iocshArgString};

const iocshArg* const kAnything[] = {&anything};
const iocshArg* const kLocation[] = {&location};
const iocshArg* const kRemote[] = {&location,   &port,      &address,
                                   &bufferSize, &queueSize, &routerOptions};
const iocshArg* const kGpibLink[] = {&gpibLink, &location, &gpibServer};

const iocshFuncDef kMpf{"mpf", 1, kAnything, "Runs a command of `mpf`, such as: mpf ls\n"};
const iocshFuncDef kMrr{"mrr", 1, kAnything, "Message router report; as `mpf mrr`.\n"};
const iocshFuncDef kMsr{"msr", 1, kAnything,
                        "Message server report: msr [server]; as `mpf msr`.\n"};
const iocshFuncDef kRouterInit{"routerInit", 0, nullptr, "Does nothing: MPF needs no daemon.\n"};
const iocshFuncDef kLocalRouter{
    "localMessageRouterStart", 1, kLocation,
    "Does nothing: servers of this host have the option --location, default 0.\n"};
const iocshFuncDef kRemoteRouter{
    "tcpMessageRouterClientStart", 6, kRemote,
    "Starts a router: clients of this host reach the servers of the other host at `location`.\n"};
const iocshFuncDef kGpibLinkConfig{
    "HiDEOSGpibLinkConfig", 3, kGpibLink,
    "GPIB links \"#L<link> A<address>\" of records reach the GPIB server at the location.\n"};

void registerCommands() {
  iocshRegister(&kMpf, [](const iocshArgBuf* values) { runMpf(argumentsOf(values, {})); });
  iocshRegister(&kMrr, [](const iocshArgBuf* values) { runMpf(argumentsOf(values, {"mrr"})); });
  iocshRegister(&kMsr, [](const iocshArgBuf* values) { runMpf(argumentsOf(values, {"msr"})); });
  iocshRegister(&kRouterInit, [](const iocshArgBuf*) {});
  iocshRegister(&kLocalRouter, [](const iocshArgBuf*) {});
  iocshRegister(&kRemoteRouter, connectRouter);
  iocshRegister(&kGpibLinkConfig, configureGpibLink);
}

}  // namespace

extern "C" {
// NOLINTNEXTLINE(misc-use-anonymous-namespace): its name is part of an exported name
static void mpfRegistrar() { registerCommands(); }
epicsExportRegistrar(mpfRegistrar);
}

}  // namespace mpf
