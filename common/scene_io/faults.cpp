#include "common/scene_io/faults.h"

#include <cctype>

#include "common/base/text.h"

namespace lightmill {

void Faults::add(std::string_view kind, std::string_view fault, std::string_view remedy) {
  if (const auto known = index_.find(kind); known != index_.end()) {
    ++kinds_[known->second].others;
  } else if (kinds_.size() == kMaxKinds) {
    ++beyond_;
  } else {
    index_.emplace(kind, kinds_.size());
    kinds_.push_back({printable(fault), printable(remedy)});
  }
}

std::vector<std::string> Faults::notices() const {
  std::vector<std::string> out;
  for (const Kind& kind : kinds_) {
    std::string remedy = kind.remedy;
    if (!remedy.empty()) {
      remedy.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(remedy.front())));
    }
    out.push_back(fmt::format("{}. {}{}", kind.fault, remedy,
                              kind.others == 0 ? "" : fmt::format(" (and {} more like it)", kind.others)));
  }
  if (beyond_ > 0) {
    out.push_back(fmt::format("{} faults of other kinds are not listed", beyond_));
  }
  return out;
}

Status Faults::as_error() const {
  return empty() ? ok_status() : invalid_argument("{}", kinds_.front().fault);
}

}  // namespace lightmill
