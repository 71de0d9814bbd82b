// SPDX-License-Identifier: MIT
// The server of the records in `mpf bench epics`, named kServer.
#pragma once

#include <mpf/message_server.h>

#include "benchmarks/epics/epics.h"
#include "benchmarks/stage/stage.h"

namespace mpf::bench {

[[nodiscard]] MessageServer makeRecordServer(const EpicsBench& bench);
// Sends each request back and counts them (RunContext::consumed). Does not return.
void echoRequests(const RunContext& context, const EpicsBench& bench);

}  // namespace mpf::bench
