// SPDX-License-Identifier: MIT
#include "epics/link_address.h"

#include <fmt/format.h>
#include <stdexcept>
#include <string_view>

#include "base/number.h"
#include "epics/gpib_links.h"
#include "shm/segment_name.h"

namespace mpf {
namespace {

std::int32_t locationOf(std::string_view text) {
  if (const auto location = tryNumber<std::int32_t>(text)) return *location;
  throw std::invalid_argument(fmt::format("location \"{}\" is not an integer", text));
}

// 0 to 30, or 100 * primary + secondary address.
bool isGpibAddress(int number) noexcept {
  constexpr int kLast = 30;
  constexpr int kPerPrimary = 100;
  const int primary = number / kPerPrimary;
  const int secondary = number % kPerPrimary;
  return number >= 0 && primary <= kLast && secondary <= kLast;
}

LinkAddress ofGpib(const gpibio& link) {
  if (!isGpibAddress(link.addr))
    throw std::invalid_argument(fmt::format(
        "GPIB address {}: use 0 to 30, or 100 * primary + secondary address", link.addr));
  const auto bus = GpibLinks::instance().find(link.link);
  if (!bus) {
    throw std::invalid_argument(
        fmt::format("GPIB link {0} has no server; call HiDEOSGpibLinkConfig({0}, location, "
                    "\"server\") before iocInit",
                    link.link));
  }
  return {bus->server, bus->location, link.addr, link.parm};
}

}  // namespace

LinkAddress LinkAddress::of(const DBLINK& link) {
  if (link.type == GPIB_IO) return ofGpib(link.value.gpibio);
  LinkAddress address;
  std::string_view text;
  if (link.type == VME_IO) {
    address.location = link.value.vmeio.card;
    address.signal = link.value.vmeio.signal;
    text = link.value.vmeio.parm;
  } else if (link.type == INST_IO) {
    text = link.value.instio.string;
  } else {
    throw std::invalid_argument(
        "the link is neither \"#C<location> S<signal> @<server>\" nor "
        "\"@<server> <parameters>\" nor \"#L<link> A<address> @<parameters>\"");
  }
  const auto end = text.find_first_of(", ");
  address.server = text.substr(0, end);
  if (end != std::string_view::npos) address.parameters = text.substr(end + 1);
  if (const auto colon = address.server.find(':');
      link.type == INST_IO && colon != std::string::npos) {
    address.location = locationOf(std::string_view(address.server).substr(colon + 1));
    address.server.resize(colon);
  }
  // Base has made an empty link of a text without the @.
  if (address.server.empty())
    throw std::invalid_argument(link.type == VME_IO
                                    ? "no server: use #C<location> S<signal> @<server>"
                                    : "no server: the link must begin with @<server>");
  SegmentName::checkServer(address.server);
  return address;
}

}  // namespace mpf
