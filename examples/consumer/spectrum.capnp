# SPDX-License-Identifier: MIT
# A message type of your own. `capnp id` makes the number of a file.
@0x8d08b74e57fab05d;

struct Spectrum {
  gain @0 :Float64;
  values @1 :List(Float64);
}
