// SPDX-License-Identifier: MIT
// GpibLinks: the GPIB server behind each link number of the IOC (the L in "#L10 A22 @ID?"), as the
// startup file configures them.
//
//   HiDEOSGpibLinkConfig(10, 0, "GPIB0")     iocsh: link 10 is the server "GPIB0" at location 0
//
// An IOC has any number of links, with servers of this host and of others.
//
// Threads  any.
// Source   drvGpib of EPICS Base 3.13: HiDEOSGpibLinkConfig(link, boardId, name). There, the call
//          waited for a remote server, and only one link worked.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>

namespace mpf {

struct GpibLink {
  std::int32_t location = 0;
  std::string server;

  bool operator==(const GpibLink&) const = default;
};

class GpibLinks {
 public:
  static GpibLinks& instance();

  // Configures a link, once; the same again is allowed. Does not wait for the server.
  //   throws  std::invalid_argument for an invalid name, and for a link that has another server
  void add(int number, const GpibLink& link);
  [[nodiscard]] std::optional<GpibLink> find(int number) const;

 private:
  mutable std::mutex mutex_;
  std::map<int, GpibLink> links_;
};

}  // namespace mpf
