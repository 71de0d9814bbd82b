// SPDX-License-Identifier: MIT
// mpf_test_libca_client get|put|monitor RECORD [VALUE]: a client of Channel Access with libca, the
// library of EPICS Base. Values are integers. Prints "VALUE SEVERITY" to stderr, `monitor` for each
// update; `put` ends when the record has processed.
#include <cadef.h>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace {

void check(int status, const char* call) {
  if (status == ECA_NORMAL) return;
  std::fprintf(stderr, "%s: %s\n", call, ca_message(status));
  std::exit(1);
}

// Waits for replies, without limit: the test has a watchdog.
void waitForReplies() { check(ca_pend_io(0), "ca_pend_io"); }

void print(const dbr_sts_long& update) {
  std::fprintf(stderr, "%d %d\n", static_cast<int>(update.value), update.severity);
}

void get(chid channel) {
  dbr_sts_long value{};
  check(ca_get(DBR_STS_LONG, channel, &value), "ca_get");
  waitForReplies();
  print(value);
}

bool isWritten = false;

void onWritten(event_handler_args result) {
  check(result.status, "ca_put_callback");
  isWritten = true;
}

void put(chid channel, dbr_long_t value) {
  check(ca_put_callback(DBR_LONG, channel, &value, onWritten, nullptr), "ca_put_callback");
  while (!isWritten) ca_pend_event(0.1);
}

void onUpdate(event_handler_args update) {
  check(update.status, "ca_create_subscription");
  print(*static_cast<const dbr_sts_long*>(update.dbr));
}

void monitor(chid channel) {
  check(ca_create_subscription(DBR_STS_LONG, 1, channel, DBE_VALUE | DBE_ALARM, onUpdate, nullptr,
                               nullptr),
        "ca_create_subscription");
  ca_pend_event(0);  // without end
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const std::string_view command = argv[1];
  check(ca_context_create(ca_disable_preemptive_callback), "ca_context_create");
  chid channel = nullptr;
  check(ca_create_channel(argv[2], nullptr, nullptr, CA_PRIORITY_DEFAULT, &channel),
        "ca_create_channel");
  waitForReplies();
  if (command == "get") get(channel);
  if (command == "put" && argc == 4) put(channel, std::atoi(argv[3]));
  if (command == "monitor") monitor(channel);
  ca_context_destroy();
  return 0;
}
