// SPDX-License-Identifier: MIT
// Commands that MPF knows and does not execute: what it has no program for, and what has no meaning
// outside vxWorks.
#include "crate/startup/commands/command_table.h"

namespace mpf::startup {
namespace {

// Servers of other packages that used MPF.
Value skipServer(CommandCall& call, StartupSite& /*site*/) {
  call.skip(Severity::warning, call.commandName(),
            "it starts a server of another package; port its source with <mpf/classic.h> and add "
            "the program to the crate file");
  return Value::unavailable();
}

Value skip(CommandCall& call, StartupSite& /*site*/) {
  call.skip(Severity::note, call.commandName(), "it has no meaning here");
  return Value();
}

Value skipSequence(CommandCall& call, StartupSite& /*site*/) {
  call.skip(Severity::warning, "seq", "mpf-ioc has no state notation programs");
  return Value();
}

constexpr CommandEntry kOtherCommands[] = {
    {"initMPCServer", skipServer},
    {"initLoveServer", skipServer},
    {"initQuadEM", skipServer},
    {"initQuadEMScan", skipServer},
    {"initQuadEMSweep", skipServer},
    {"initQuadEMPID", skipServer},
    {"AIMConfig", skipServer},
    {"icbSetup", skipServer},
    {"icbConfig", skipServer},
    {"icbAddModule", skipServer},
    {"icbTcaConfig", skipServer},
    {"DXPConfig", skipServer},
    {"seq", skipSequence},
    {"ld", skip},
    {"module_types", skip},
    {"taskDelay", skip},
    {"shellPromptSet", skip},
    {"loginUserAdd", skip},
    {"hostAdd", skip},
    {"nfsMount", skip},
    {"nfsAuthUnixSet", skip},
    {"registerRecordDeviceDriver", skip},
};

}  // namespace

std::span<const CommandEntry> otherCommands() { return kOtherCommands; }

}  // namespace mpf::startup
