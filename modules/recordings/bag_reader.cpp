#include "modules/recordings/bag_reader.hpp"

#include <array>

namespace km {

const char* to_string(BagFault fault) {
  // In the order of BagFault.
  static constexpr std::array<const char*, 8> kNames = {
      "truncated parts",
      "unusable indexes",
      "malformed records",
      "wrong checksums",
      "parts that cannot be decompressed",
      "messages of unknown channels",
      "messages earlier than the index states",
      "lost messages",
  };
  return kNames.at(static_cast<std::size_t>(fault));
}

}  // namespace km
