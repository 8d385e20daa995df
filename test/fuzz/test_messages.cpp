#include <catch2/catch.hpp>

#include <cstdlib>

#include "runtime/dds/codec.hpp"
#include "test/fuzz/all_messages.hpp"
#include "test/support/spoilt_input.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST_CASE("What robots send each other is understood as it is sent", "[messages]") {
  for (const MessageReader& reader : all_messages()) {
    CAPTURE(reader.name);
    for (const Bytes& sample : reader.samples) CHECK(feed(reader, sample));
  }
}

TEST_CASE("No message ends where it does not end", "[messages]") {
  for (const MessageReader& reader : all_messages()) {
    CAPTURE(reader.name);
    for (Bytes sample : reader.samples)
      while (!sample.empty()) {
        sample.pop_back();
        CHECK_FALSE(feed(reader, sample));
      }
  }
}

// KM_MESSAGES sets how many.
TEST_CASE("Spoilt messages of all topics harm nobody", "[messages]") {
  const char* wanted = std::getenv("KM_MESSAGES");
  const long count = wanted == nullptr ? 100'000 : std::atol(wanted);
  const auto readers = all_messages();
  InputSpoiler spoiler(GENERATE(1U, 2U));
  long accepted = 0;
  for (long k = 0; k < count / 2; ++k) {
    const MessageReader& reader = readers[static_cast<std::size_t>(k) % readers.size()];
    accepted += feed(reader, spoiler(reader.samples)) ? 1 : 0;
  }
  // Some bytes are free, most are not.
  CHECK(accepted > 0);
  CHECK(accepted < count / 4);
}

}  // namespace
}  // namespace km
