#include "apps/lab/experiments/step_record.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <thread>

#include "apps/output_file.hpp"
#include "modules/core/bytes.hpp"
#include "modules/core/json.hpp"

namespace km {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Machine, processor, cores, memory_gb, load)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(StepRecord, step, fingerprint, command, started, seconds, commit,
                                   machine)

namespace {

namespace fs = std::filesystem;

fs::path record_file(const fs::path& results, const std::string& step) {
  return results / "steps" / (step + ".json");
}

// Detects changes; it is not secure against attacks.
class Fingerprint {
 public:
  void add(const std::string& text) {
    mix_fnv1a(hash_, text.size());
    mix(text);
  }

  void add_file(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    mix_fnv1a(hash_, in ? 1 : 0);
    std::vector<char> buffer(1 << 16);
    std::uint64_t size = 0;
    while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || in.gcount() > 0) {
      const auto count = static_cast<std::size_t>(in.gcount());
      mix({buffer.data(), count});
      size += count;
    }
    mix_fnv1a(hash_, size);
  }

  std::string text() const {
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash_));
    return digits;
  }

 private:
  void mix(std::string_view bytes) {
    mix_fnv1a(hash_, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  }

  std::uint64_t hash_ = kFnv1aBasis;
};

std::string line_value(const char* file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(key)) {
      const std::size_t colon = line.find(':');
      const std::size_t begin = line.find_first_not_of(" \t", colon + 1);
      return begin == line.npos ? std::string() : line.substr(begin);
    }
  return {};
}

// "city" of "data/city/".
std::string last_name(const fs::path& path) {
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

// A text in which every path is reduced to its last name.
std::string without_folders(const std::string& text) {
  std::string names;
  for (const char c : text)
    if (c == '/')
      names.erase(names.find_last_of(" \n\"'[{,:") + 1);
    else
      names += c;
  return names;
}

}  // namespace

bool all_exist(const std::vector<fs::path>& files) {
  return std::all_of(files.begin(), files.end(), [](const fs::path& f) { return fs::exists(f); });
}

Machine this_machine() {
  Machine machine;
  machine.processor = line_value("/proc/cpuinfo", "model name");
  machine.cores = std::thread::hardware_concurrency();
  machine.memory_gb =
      1e-6 * 1.024 * std::strtod(line_value("/proc/meminfo", "MemTotal").c_str(), nullptr);
  if (getloadavg(&machine.load, 1) != 1) machine.load = 0.0;
  return machine;
}

std::string fingerprint_of(const Step& step) {
  Fingerprint fingerprint;
  for (const std::string& word : step.command)
    fingerprint.add(word.find('/') == word.npos ? word : last_name(word));
  for (const auto& [file, text] : step.writes) fingerprint.add(without_folders(text));
  for (const fs::path& input : step.inputs) fingerprint.add_file(input);
  return fingerprint.text();
}

std::optional<StepRecord> read_record(const fs::path& results, const std::string& step) try {
  std::ifstream file(record_file(results, step));
  if (!file) return std::nullopt;
  return nlohmann::json::parse(file).get<StepRecord>();
} catch (const nlohmann::json::exception&) {
  return std::nullopt;  // cut short, for instance by a full disk: the step is run again
}

void write_record(const fs::path& results, const StepRecord& record) {
  const fs::path file = record_file(results, record.step);
  fs::create_directories(file.parent_path());
  write_output(file, [&](std::ostream& out) { out << json_text(nlohmann::json(record)); });
}

const char* to_string(StepState state) {
  switch (state) {
    case StepState::kDone:
      return "done";
    case StepState::kFound:
      return "found";
    case StepState::kOutdated:
      return "outdated";
    case StepState::kToDo:
      return "to do";
    case StepState::kMissing:
      return "missing";
  }
  return "?";
}

StepState state_of(const Step& step, const fs::path& results) {
  const auto record = read_record(results, step.name);
  const bool made = all_exist(step.outputs);
  // A result that was made elsewhere does not depend on the command of the step.
  if (made && record && record->command.empty() && step.adoptable) return StepState::kDone;
  if (made && record && record->fingerprint == fingerprint_of(step)) return StepState::kDone;
  if (made && !record && step.adoptable) return StepState::kFound;
  if (!step.missing.empty()) return StepState::kMissing;
  return made && record ? StepState::kOutdated : StepState::kToDo;
}

}  // namespace km
