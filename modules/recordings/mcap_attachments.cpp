#include "modules/recordings/mcap_attachments.hpp"

#include <cstdint>

#include "modules/core/input_file.hpp"
#include "modules/recordings/decompress.hpp"
#include "modules/recordings/mcap_records.hpp"
#include "modules/recordings/random_access_file.hpp"

namespace km {

std::map<std::string, std::string> read_mcap_attachments(const std::filesystem::path& path) {
  const RandomAccessFile file(path);
  if (file.beginning(kMcapMagic.size()) != kMcapMagic)
    throw InputFileError(file.place(0) + ": does not begin as MCAP files of version 0 do");
  std::map<std::string, std::string> found;
  std::uint64_t at = kMcapMagic.size();
  while (file.has(at, kMcapRecordHeader_bytes)) {
    const auto header = parse_mcap_record_header(file.read(at, kMcapRecordHeader_bytes));
    if (!header || header->is(McapOpcode::kDataEnd)) break;
    const std::uint64_t begin = at + kMcapRecordHeader_bytes;
    if (!file.has(begin, header->size)) break;
    if (header->is(McapOpcode::kAttachment)) {
      if (header->size > kMaxDecompressed_bytes)
        throw InputFileError(file.place(at) + ": an attachment of more than 512 MiB");
      const auto bytes = file.read(begin, header->size);
      const auto attachment = parse_mcap<McapAttachment>(bytes);
      if (!attachment) throw InputFileError(file.place(at) + ": an attachment that is damaged");
      found[attachment->name].assign(attachment->data.begin(), attachment->data.end());
    }
    at = begin + header->size;
  }
  return found;
}

}  // namespace km
