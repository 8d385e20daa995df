#include <malloc.h>

#include "runtime/dds/codec.hpp"
#include "test/fuzz/all_messages.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST_CASE("Every message between robots is decoded as it was sent") {
  for (const MessageReader& reader : all_messages()) {
    CAPTURE(reader.name);
    for (const Bytes& sample : reader.samples) CHECK(feed(reader, sample));
  }
}

TEST_CASE("A truncated message is refused") {
  for (const MessageReader& reader : all_messages()) {
    CAPTURE(reader.name);
    for (Bytes sample : reader.samples)
      while (!sample.empty()) {
        sample.pop_back();
        CHECK_FALSE(feed(reader, sample));
      }
  }
}

// Bytes in use on the C library's heap. Sanitizers replace it; theirs finds leaks itself.
std::size_t in_use() {
  const struct mallinfo2 heap = mallinfo2();
  return heap.uordblks + heap.hblkhd;
}

// KM_MESSAGES sets the number.
TEST_CASE("Corrupted messages of all topics do no harm and leave no memory behind") {
  const char* wanted = std::getenv("KM_MESSAGES");
  const long count = wanted == nullptr ? 100'000 : std::atol(wanted);
  const auto readers = all_messages();
  InputCorrupter corrupter(GENERATE(1U, 2U));
  long accepted = 0;
  const auto feed_messages = [&](long messages) {
    for (long k = 0; k < messages; ++k) {
      const MessageReader& reader = readers[static_cast<std::size_t>(k) % readers.size()];
      accepted += feed(reader, corrupter(reader.samples)) ? 1 : 0;
    }
  };
  constexpr long kFirst = 1000;  // one-time allocations are made by then
  feed_messages(kFirst);
  const std::size_t before = in_use();
  feed_messages(count / 2 - kFirst);
  constexpr std::size_t kOfOthers = 64 << 10U;  // the threads of DDS
  CHECK(in_use() < before + kOfOthers);
  // Some bytes are free, most are not.
  CHECK(accepted > 0);
  CHECK(accepted < count / 4);
}

}  // namespace
}  // namespace km
