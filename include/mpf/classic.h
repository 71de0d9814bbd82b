// SPDX-License-Identifier: MIT
// The API of the original MPF for servers and clients: sources of 1999 compile unchanged
// (docs/classic.md). Device support of EPICS records: <mpf/epics/classic.h>.
//
// The target mpf::classic finds the old names of headers, such as <MessageServer.h> and
// <taskLib.h>, which include this header.
#pragma once

#include <mpf/classic/message.h>
#include <mpf/classic/message_client.h>
#include <mpf/classic/message_server.h>
#include <mpf/classic/vxworks.h>
