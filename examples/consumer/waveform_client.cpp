// SPDX-License-Identifier: MIT
// waveform_client COUNT: subscribes to waveform_server and prints the peak of COUNT waveforms.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>

#include <mpf/sync_client.h>

int main(int argc, char** argv) {
  using namespace std::chrono_literals;
  if (argc != 2) {
    std::cerr << "usage: waveform_client COUNT\n";
    return 2;
  }
  mpf::SyncClient client(mpf::Backplane::attach(), "waveform");
  // The first reply ends the request; the server continues to send waveforms.
  auto first = client.call(mpf::Int32Message(), 5s);
  if (!first) {
    std::cerr << "waveform_client: " << first.why() << '\n';
    return 1;
  }
  auto waveform = std::move(first.message());
  for (int left = std::atoi(argv[1]); left > 0; --left) {
    // in shared memory, until the message is destroyed
    const auto samples = waveform.valueAs<mpf::Float64Array>();
    if (samples.empty()) {
      std::cerr << "waveform_client: no waveform within 5 s\n";
      return 1;
    }
    std::cout << samples.size() << " samples, peak " << *std::ranges::max_element(samples) << '\n';
    if (left > 1) waveform = client.receive(5s);
  }
}
