// SPDX-License-Identifier: MIT
// camera_client COUNT: subscribes to camera_server and prints the size of COUNT images, and how
// many were missed before each.
#include <chrono>
#include <cstdlib>
#include <iostream>

#include <mpf/sync_client.h>

int main(int argc, char** argv) {
  using namespace std::chrono_literals;
  if (argc != 2) {
    std::cerr << "usage: camera_client COUNT\n";
    return 2;
  }
  mpf::SyncClient client(mpf::Backplane::attach(), "camera");
  // The first image ends the request; the server continues to send images.
  auto first = client.call(mpf::Int32Message(), 5s);
  if (!first) {
    std::cerr << "camera_client: " << first.why() << '\n';
    return 1;
  }
  auto image = std::move(first.message());
  for (int left = std::atoi(argv[1]); left > 0; --left) {
    const auto pixels = image.valueAs<mpf::Int32Array>();
    if (pixels.empty()) {
      std::cerr << "camera_client: no image within 5 s\n";
      return 1;
    }
    std::cout << pixels.size() << " pixels, " << image.getMissed() << " missed\n";
    image.reset();  // the server may use its memory again
    if (left > 1) image = client.receive(5s);
  }
}
