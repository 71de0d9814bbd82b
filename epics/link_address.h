// SPDX-License-Identifier: MIT
// LinkAddress: the server that an INP or OUT link names.
//
//   #C<location> S<signal> @<server>[,| ]<parameters>     VME_IO
//   @<server>[:<location>][,| ]<parameters>               INST_IO; location 0 unless given
//   #L<link> A<address> @<parameters>                     GPIB_IO; see gpib_links.h
//
// Source   manual, "MPF Device support": format of the INP or OUT field.
#pragma once

#include <cstdint>
#include <link.h>
#include <string>

namespace mpf {

struct LinkAddress {
  std::string server;
  std::int32_t location = 0;
  int signal = 0;  // or the GPIB address
  std::string parameters;

  //   throws  std::invalid_argument, which says what is wrong with the link
  static LinkAddress of(const DBLINK& link);
};

}  // namespace mpf
