#include "common/methods/method.h"

#include "common/methods/path/path_method.h"
#include "common/methods/preview/preview_method.h"

namespace lightmill {
namespace {

struct Entry {
  std::string_view name;
  std::unique_ptr<Method> (*make)(std::shared_ptr<const CompiledScene>, const MethodSettings&);
};
constexpr std::array kMethods{Entry{"path", make_path_method}, Entry{"preview", make_preview_method}};

}  // namespace

const std::vector<std::string_view>& method_names() {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> list;
    for (const Entry& entry : kMethods) {
      list.push_back(entry.name);
    }
    return list;
  }();
  return names;
}

Result<std::unique_ptr<Method>> make_method(std::shared_ptr<const CompiledScene> scene,
                                            const MethodSettings& settings) {
  for (const Entry& entry : kMethods) {
    if (entry.name == settings.name) {
      LM_RETURN_IF_ERROR(check_method_layers(entry.name, settings.layers));
      return entry.make(std::move(scene), settings);
    }
  }
  return invalid_argument("unknown method \"{}\"; the methods are {}", settings.name, fmt::join(method_names(), ", "));
}

}  // namespace lightmill
