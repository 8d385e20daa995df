#include "modules/core/io/xml_text.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace km {

std::string xml_escaped(std::string_view text) {
  using Entity = std::pair<char, std::string_view>;
  constexpr Entity kEntities[] = {
      {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'\'', "&apos;"}, {'"', "&quot;"}};
  std::string result;
  for (const char c : text) {
    const Entity* const entity = std::ranges::find(kEntities, c, &Entity::first);
    if (entity != std::end(kEntities))
      result += entity->second;
    else
      result += c;
  }
  return result;
}

}  // namespace km
