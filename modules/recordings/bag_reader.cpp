#include "modules/recordings/bag_reader.hpp"

namespace km {

const char* to_string(BagFault fault) {
  switch (fault) {
    case BagFault::kTruncated:
      return "truncated parts";
    case BagFault::kIndex:
      return "unusable indexes";
    case BagFault::kMalformed:
      return "malformed records";
    case BagFault::kChecksum:
      return "wrong checksums";
    case BagFault::kCompression:
      return "parts that cannot be decompressed";
    case BagFault::kUnknownChannel:
      return "messages of unknown channels";
    case BagFault::kUnordered:
      return "messages earlier than the index states";
    case BagFault::kLost:
      return "lost messages";
  }
  return "unknown faults";
}

}  // namespace km
