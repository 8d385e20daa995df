#include "modules/place_recognition/vocabulary_file.hpp"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "modules/core/io/input_file.hpp"

namespace km {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the format is read as it lies in memory");

constexpr std::array<char, 8> kMagic = {'K', 'M', 'V', 'O', 'C', 'A', 'B', '\0'};
constexpr std::uint32_t kFormat = 1;

struct FileHeader {
  std::array<char, 8> magic;
  std::uint32_t format;
  std::uint32_t branching;
  std::uint32_t depth;
  std::uint32_t nodes;
  std::uint32_t words;
  std::uint32_t zero;
  std::uint64_t fingerprint;
};
static_assert(sizeof(FileHeader) == 40);

std::uint64_t file_size(const FileHeader& header) {
  const std::uint64_t centers = header.nodes == 0 ? 0 : header.nodes - 1;
  return sizeof(FileHeader) + std::uint64_t{header.nodes} + sizeof(BinaryDescriptor) * centers +
         sizeof(float) * std::uint64_t{header.words};
}

// Throws the error of a file with its name and offset.
class Refusal {
 public:
  explicit Refusal(std::string name) : name_(std::move(name)) {}

  [[noreturn]] void operator()(std::uint64_t offset, const std::string& what) const {
    throw std::runtime_error("vocabulary " + name_ + ", offset " + std::to_string(offset) + ": " +
                             what);
  }

 private:
  std::string name_;
};

FileHeader read_header(const std::string& bytes, const Refusal& refuse) {
  FileHeader header{};
  if (bytes.size() < sizeof(header))
    refuse(bytes.size(), "ends inside the header of " + std::to_string(sizeof(header)) + " bytes");
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (header.magic != kMagic) refuse(0, "not a vocabulary: it does not start with KMVOCAB");
  if (header.format != kFormat)
    refuse(8, "format version " + std::to_string(header.format) + ", known is " +
                  std::to_string(kFormat));
  if (header.branching > kMaxBranching)
    refuse(12, "branching " + std::to_string(header.branching) + " is above " +
                   std::to_string(kMaxBranching));
  if (header.depth > kMaxDepth)
    refuse(16, "depth " + std::to_string(header.depth) + " is above " + std::to_string(kMaxDepth));
  if (header.nodes > kMaxVocabularyNodes || header.words > header.nodes)
    refuse(20, std::to_string(header.nodes) + " nodes with " + std::to_string(header.words) +
                   " words; at most " + std::to_string(kMaxVocabularyNodes) +
                   " nodes, and no more words than nodes");
  const std::uint64_t size = file_size(header);
  if (bytes.size() != size)
    refuse(bytes.size(), "is the end, but the header states " + std::to_string(size) + " bytes");
  return header;
}

void append(std::string& bytes, const void* data, std::size_t size) {
  bytes.append(static_cast<const char*>(data), size);
}

}  // namespace

std::string serialize(const VocabularyData& data) {
  const FileHeader header{.magic = kMagic,
                          .format = kFormat,
                          .branching = static_cast<std::uint32_t>(data.branching),
                          .depth = static_cast<std::uint32_t>(data.depth),
                          .nodes = static_cast<std::uint32_t>(data.children.size()),
                          .words = static_cast<std::uint32_t>(data.idf.size()),
                          .zero = 0,
                          .fingerprint = fingerprint(data)};
  std::string bytes;
  append(bytes, &header, sizeof(header));
  append(bytes, data.children.data(), data.children.size());
  for (std::size_t i = 1; i < data.centers.size(); ++i)
    append(bytes, data.centers[i].data(), data.centers[i].size());
  append(bytes, data.idf.data(), data.idf.size() * sizeof(float));
  return bytes;
}

VocabularyData deserialize(const std::string& bytes, const std::string& name) {
  const Refusal refuse(name);
  const FileHeader header = read_header(bytes, refuse);
  VocabularyData data{.branching = static_cast<int>(header.branching),
                      .depth = static_cast<int>(header.depth)};
  const char* at = bytes.data() + sizeof(header);
  const auto take = [&at](void* to, std::size_t size) {
    if (size != 0) std::memcpy(to, at, size);
    at += size;
  };
  data.children.resize(header.nodes);
  data.centers.resize(header.nodes);
  data.idf.resize(header.words);
  take(data.children.data(), data.children.size());
  for (std::size_t i = 1; i < data.centers.size(); ++i)
    take(data.centers[i].data(), data.centers[i].size());
  take(data.idf.data(), data.idf.size() * sizeof(float));
  if (fingerprint(data) != header.fingerprint)
    refuse(32, "the checksum does not match: the file is damaged");
  if (const std::string problem = problem_of(data); !problem.empty())
    refuse(sizeof(header), problem);
  return data;
}

Vocabulary load_vocabulary(const std::filesystem::path& path) {
  try {
    return Vocabulary(deserialize(read_input_file(path), path.string()));
  } catch (const InputFileError& error) {
    throw std::runtime_error(std::string("vocabulary ") + error.what());
  }
}

void save_vocabulary(const VocabularyData& data, const std::filesystem::path& path) {
  const std::string bytes = serialize(data);
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush())
    throw std::runtime_error("vocabulary " + path.string() + ": cannot be written");
}

}  // namespace km
