#include "client/cli/units.h"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "common/base/text.h"
#include "common/farm/job_rules.h"

namespace lightmill::cli {

std::string human_seconds(double seconds) {
  if (!(seconds >= 0) || seconds > 1e15) {
    return "?";
  }
  if (seconds > 0 && seconds < 0.05) {
    return "< 0.1 s";
  }
  if (seconds < 9.95) {
    return fmt::format("{:.1f} s", seconds);
  }
  const auto whole = static_cast<std::uint64_t>(std::llround(seconds));
  if (whole < 60) {
    return fmt::format("{} s", whole);
  }
  const std::uint64_t days = whole / 86400, hours = whole / 3600 % 24, minutes = whole / 60 % 60;
  if (days > 0) {
    return fmt::format("{} d {:02} h", days, hours);
  }
  return hours > 0 ? fmt::format("{} h {:02} min", hours, minutes) : fmt::format("{} min {:02} s", minutes, whole % 60);
}

std::string rough_seconds(double seconds) {
  if (!(seconds >= 59.5) || seconds > 1e15) {
    return human_seconds(seconds);
  }
  return seconds < 3570     ? fmt::format("{:.0f} min", seconds / 60)
         : seconds < 86'000 ? fmt::format("{:.1f} h", seconds / 3600)
                            : fmt::format("{:.{}f} d", seconds / 86'400, seconds < 8.6e6 ? 1 : 0);
}

std::string human_count(double count) {
  if (!std::isfinite(count) || count < 0) {
    return "?";
  }
  if (count < 999.5) {
    return count == std::floor(count) ? fmt::format("{:.0f}", count) : three_digits(count);
  }
  constexpr std::string_view kPrefixes = "kMGTPE";
  std::size_t prefix = 0;
  for (count /= 1000; count >= 999.5 && prefix + 1 < kPrefixes.size(); count /= 1000) {
    ++prefix;
  }
  return fmt::format("{} {}", three_digits(count), kPrefixes[prefix]);
}

std::string human_rate(double samples_per_second) {
  const std::string count = human_count(samples_per_second);
  return count + (std::isalpha(static_cast<unsigned char>(count.back())) != 0 ? "" : " ") + "samples/s";
}

namespace {

std::string local_time(std::int64_t unix_ms, const char* format) {
  const std::time_t seconds = unix_ms / 1000;
  std::tm parts{};
  localtime_r(&seconds, &parts);
  std::array<char, 64> text{};
  return {text.data(), std::strftime(text.data(), text.size(), format, &parts)};
}

}  // namespace

std::string human_date(std::int64_t unix_ms) {
  return unix_ms == 0 ? "-" : local_time(unix_ms, "%Y-%m-%d %H:%M");
}

std::string human_day(std::int64_t unix_ms, std::int64_t now_ms) {
  const std::string day = unix_ms == 0 ? "-" : local_time(unix_ms, "%Y-%m-%d");
  return day == local_time(now_ms, "%Y-%m-%d") ? local_time(unix_ms, "%H:%M") : day;
}

std::string human_moment(std::int64_t unix_ms) {
  return local_time(unix_ms, "%Y-%m-%d %H:%M:%S%z");
}

Result<std::pair<int, int>> parse_size(std::string_view text) {
  const std::size_t cross = text.find_first_of("xX");
  if (cross != std::string_view::npos) {
    const auto width = parse_number<int>(text.substr(0, cross));
    const auto height = parse_number<int>(text.substr(cross + 1));
    if (width && height && is_film_side(*width) && is_film_side(*height)) {
      return std::pair{*width, *height};
    }
  }
  return invalid_argument("a size is WIDTHxHEIGHT, each 1 to {} pixels (as in 640x480), got '{}'", kMaxFilmSide, text);
}

Result<PixelRect> parse_crop(std::string_view text) {
  std::array<int, 4> numbers{};
  std::string_view rest = text;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::size_t comma = i < 3 ? rest.find(',') : rest.size();
    const auto number = comma == std::string_view::npos ? std::nullopt : parse_number<int>(rest.substr(0, comma));
    if (!number || !(is_film_side(*number) || (i < 2 && *number == 0))) {
      return invalid_argument("a crop is X,Y,WIDTH,HEIGHT in pixels from the upper left (as in 0,0,64,64), got '{}'",
                              text);
    }
    numbers[i] = *number;
    rest.remove_prefix(std::min(comma + 1, rest.size()));
  }
  return PixelRect{numbers[0], numbers[1], numbers[2], numbers[3]};
}

namespace {

template <class Number>
Result<Number> whole(std::string_view text, Number least, Number most) {
  const auto number = parse_number<Number>(text);
  if (!number || *number < least || *number > most) {
    return invalid_argument("must be a whole number from {} to {}, got '{}'", least, most, text);
  }
  return *number;
}

}  // namespace

Result<std::int64_t> parse_whole(std::string_view text, std::int64_t least, std::int64_t most) {
  return whole(text, least, most);
}

Result<std::uint64_t> parse_whole(std::string_view text, std::uint64_t least, std::uint64_t most) {
  return whole(text, least, most);
}

Result<double> parse_real(std::string_view text, double least, double most) {
  const auto number = parse_number<double>(text);
  if (!number || !(*number >= least && *number <= most)) {
    return invalid_argument("must be a number from {} to {}, got '{}'", least, most, text);
  }
  return *number;
}

Result<double> parse_error(std::string_view text) {
  const auto number = parse_number<double>(text);
  if (!number) {
    return invalid_argument("an error is a number (as in 0.01 or 1e-3), got '{}'", text);
  }
  LM_RETURN_IF_ERROR(check_goal_error(*number));
  return *number;
}

Result<double> parse_share(std::string_view text) {
  if (text == "all" || text == "none") {
    return text == "all" ? 1.0 : 0.0;
  }
  const bool in_percent = text.ends_with('%');
  const auto number = parse_number<double>(text.substr(0, text.size() - (in_percent ? 1 : 0)));
  if (!in_percent || !number || !(*number >= 0 && *number <= 100)) {
    return invalid_argument("a share is a percentage from 0% to 100% (as in 5%), all or none, got '{}'", text);
  }
  return *number / 100;
}

Result<double> parse_time(std::string_view text) {
  constexpr std::string_view kUnits = "smhdw";
  constexpr std::array<double, 5> kSeconds{1, 60, 3600, 86400, 7 * 86400};
  std::string_view digits = text;
  double unit = 1;
  if (!text.empty()) {
    if (const std::size_t at = kUnits.find(text.back()); at != std::string_view::npos) {
      unit = kSeconds[at];
      digits.remove_suffix(1);
    }
  }
  const auto number = parse_number<double>(digits);
  if (!number) {
    return invalid_argument("a time is a number of seconds, or one with s, m, h, d or w (as in 90, 1.5m, 2h), got '{}'",
                            text);
  }
  return *number * unit;
}

Result<double> parse_seconds(std::string_view text) {
  LM_ASSIGN_OR_RETURN(const double seconds, parse_time(text));
  LM_RETURN_IF_ERROR(check_goal_seconds(seconds));
  return seconds;
}

}  // namespace lightmill::cli
