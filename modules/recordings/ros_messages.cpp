#include "modules/recordings/ros_messages.hpp"

#include <algorithm>
#include <stdexcept>

namespace km {
namespace {

std::string_view fields_of(std::string_view type) {
  const auto* const known = std::ranges::find(kRosDefinitions, type, &RosDefinition::type);
  if (known == std::end(kRosDefinitions))
    throw std::invalid_argument("no definition of messages of " + std::string(type));
  return known->fields;
}

// Types of messages in a list of fields. A blank, or "[" for arrays, follows the type of a field.
std::vector<std::string_view> types_in(std::string_view fields) {
  std::vector<std::string_view> types;
  while (!fields.empty()) {
    const std::string_view type = fields.substr(0, fields.find_first_of(" ["));
    if (type.find('/') != type.npos) types.push_back(type);
    fields.remove_prefix(fields.find('\n') + 1);
  }
  return types;
}

}  // namespace

bool is_of_type(const BagChannel& channel, std::string_view type) {
  if (type == RosTFMessage::kType && channel.type == "tf/tfMessage") return true;  // former name
  return channel.type == type || channel.type == ros2_name(type);
}

std::string ros2_name(std::string_view type) {
  const std::size_t slash = type.find('/');
  return std::string(type.substr(0, slash)) + "/msg" + std::string(type.substr(slash));
}

std::string ros1_name(std::string_view type) {
  const std::size_t slash = type.find("/msg/");
  if (slash == type.npos) return std::string(type);
  return std::string(type.substr(0, slash)) + std::string(type.substr(slash + 4));
}

std::string ros_name(std::string name) {
  for (char& c : name) {
    const bool is_fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!is_fine) c = '_';
  }
  return name;
}

std::string ros_definition(std::string_view type) {
  constexpr std::size_t kRule = 80;  // characters
  const std::string rule(kRule, '=');
  std::string text(fields_of(type));
  std::vector<std::string_view> types = types_in(fields_of(type));
  for (std::size_t k = 0; k < types.size(); ++k) {
    if (std::ranges::find(types, types[k]) - types.begin() != static_cast<std::ptrdiff_t>(k))
      continue;
    const std::string_view fields = fields_of(types[k]);
    text += rule + "\nMSG: " + std::string(types[k]) + '\n' + std::string(fields);
    const auto more = types_in(fields);
    types.insert(types.end(), more.begin(), more.end());
  }
  return text;
}

}  // namespace km
