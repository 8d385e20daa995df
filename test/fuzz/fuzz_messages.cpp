// libFuzzer's entry: the first byte chooses the topic, the rest is its message. See idl/README.md.
#include <cstddef>
#include <cstdint>

#include "test/fuzz/all_messages.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<km::MessageReader> readers = km::all_messages();
  if (size > 0) km::feed(readers[data[0] % readers.size()], {data + 1, size - 1});
  return 0;
}
