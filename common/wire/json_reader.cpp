#include "common/wire/json_reader.h"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/text.h"
#include "common/scene/document.h"

namespace lightmill {
namespace {

namespace pb = google::protobuf;

/// An iterator for nlohmann's parser that shows the reader how far it has come.
class CountingIterator {
 public:
  using iterator_category = std::forward_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, const char** reached) : at_(at), reached_(reached) {}
  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    *reached_ = ++at_;
    return *this;
  }
  CountingIterator operator++(int) {
    CountingIterator old = *this;
    ++*this;
    return old;
  }
  friend bool operator==(const CountingIterator& a, const CountingIterator& b) { return a.at_ == b.at_; }

 private:
  const char* at_;
  const char** reached_;
};

/// Whether a message may also be written as a list of its numbers.
bool is_number_tuple(const pb::Descriptor& type) {
  return type.full_name() == "lightmill.v1.Vec3" || type.full_name() == "lightmill.v1.Vec2" ||
         type.full_name() == "lightmill.v1.Color.Rgb";
}

/// Names with commas between them: "a, b, c".
template <class Count, class Name>
std::string list_names(Count count, const Name& name) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    const std::string one = name(i);
    text += (text.empty() || one.empty() ? "" : ", ") + one;
  }
  return text;
}

std::string enum_names(const pb::EnumDescriptor& type) {
  return list_names(type.value_count(),
                    [&](int i) { return type.value(i)->number() == 0 ? std::string() : type.value(i)->name(); });
}

std::string field_names(const pb::Descriptor& type) {
  return list_names(type.field_count(), [&](int i) { return type.field(i)->name(); });
}

/// Description of a valid value of a field, for errors.
std::string expected_of(const pb::FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_BOOL:
      return "true or false is expected";
    case pb::FieldDescriptor::CPPTYPE_STRING:
      return "a string is expected";
    case pb::FieldDescriptor::CPPTYPE_ENUM:
      return fmt::format("one of {} is expected", enum_names(*field.enum_type()));
    case pb::FieldDescriptor::CPPTYPE_MESSAGE:
      if (is_number_tuple(*field.message_type())) {
        return fmt::format("{} numbers [{}] are expected", field.message_type()->field_count(),
                           field_names(*field.message_type()));
      }
      if (field.message_type()->full_name() == "lightmill.v1.Color") {
        return "a colour is expected, as in {\"rgb\": [0.5, 0.5, 0.5]}";
      }
      return fmt::format("an object with {} is expected", field_names(*field.message_type()));
    case pb::FieldDescriptor::CPPTYPE_INT32:
      return "an integer is expected";
    default:
      return "a number is expected";
  }
}

/// Checks the parser's events against the descriptors and writes them into the message. Stops at the first error.
class JsonReader final : public nlohmann::json_sax<nlohmann::json> {
 public:
  JsonReader(std::string_view text, pb::Message& message, SourceMap& source)
      : text_(text), reached_(text.data()), previous_(text.data()), root_(message), source_(source) {}

  Status read() {
    const CountingIterator begin(text_.data(), &reached_);
    const CountingIterator end(text_.data() + text_.size(), &reached_);
    nlohmann::json::sax_parse(begin, end, static_cast<nlohmann::json_sax<nlohmann::json>*>(this));
    return status_;
  }

  bool null() override {
    next_token();
    return take_target() &&
           fail(path_, "null is not allowed: {}. The field may also be left out", expected_of(*field_));
  }
  bool boolean(bool value) override {
    next_token();
    if (!take_scalar(value ? "true" : "false")) {
      return false;
    }
    if (field_->cpp_type() != pb::FieldDescriptor::CPPTYPE_BOOL) {
      return wrong_type(value ? "true" : "false");
    }
    target_->GetReflection()->SetBool(target_, field_, value);
    return true;
  }
  bool number_integer(number_integer_t value) override {
    next_token();
    return number(static_cast<double>(value), true, std::to_string(value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    next_token();
    return number(static_cast<double>(value), true, std::to_string(value));
  }
  bool number_float(number_float_t value, const string_t& text) override {
    next_token();
    return number(value, false, text);
  }
  bool string(string_t& value) override {
    next_token();
    if (!take_scalar("a string")) {
      return false;
    }
    const pb::Reflection& reflection = *target_->GetReflection();
    if (field_->cpp_type() == pb::FieldDescriptor::CPPTYPE_ENUM) {
      const pb::EnumValueDescriptor* named = field_->enum_type()->FindValueByName(value);
      if (named == nullptr || named->number() == 0) {
        return fail(path_, "unknown value \"{}\": {}", value, expected_of(*field_));
      }
      reflection.SetEnum(target_, field_, named);
      return true;
    }
    if (field_->cpp_type() != pb::FieldDescriptor::CPPTYPE_STRING) {
      return wrong_type("a string");
    }
    reflection.SetString(target_, field_, value);
    return true;
  }
  bool binary(binary_t&) override { return fail("", "binary values are not JSON"); }

  bool start_object(std::size_t) override {
    next_token();
    if (frames_.empty()) {
      source_.add("", token_);
      frames_.push_back({Frame::Kind::fields, &root_, nullptr, "", {}, 0});
      return true;
    }
    if (!take_scalar("an object")) {
      return false;
    }
    if (field_->cpp_type() != pb::FieldDescriptor::CPPTYPE_MESSAGE) {
      return wrong_type("an object");
    }
    if (frames_.size() == kMaxDepth) {
      return fail(cut_text(path_, 100), "objects and lists can be nested {} deep", kMaxDepth);
    }
    frames_.push_back({Frame::Kind::fields, open_message(), nullptr, path_, {}, 0});
    return true;
  }
  bool key(string_t& name) override {
    next_token();
    Frame& frame = frames_.back();
    const pb::Descriptor& type = *frame.message->GetDescriptor();
    const std::string path = frame.path.empty() ? name : frame.path + "." + name;
    const pb::FieldDescriptor* field = type.FindFieldByName(name);
    if (field == nullptr) {
      return fail(path, "unknown field. Known fields: {}", field_names(type));
    }
    if (std::find(frame.seen.begin(), frame.seen.end(), field) != frame.seen.end()) {
      return fail(path, "the field is given twice");
    }
    if (const pb::OneofDescriptor* oneof = field->real_containing_oneof(); oneof != nullptr) {
      for (const pb::FieldDescriptor* other : frame.seen) {
        if (other->real_containing_oneof() == oneof) {
          return fail(path, "only one of {} may be given, and {} is given already",
                      list_names(oneof->field_count(), [&](int i) { return oneof->field(i)->name(); }), other->name());
        }
      }
    }
    frame.seen.push_back(field);
    frame.field = field;
    return true;
  }
  bool end_object() override { return close(); }

  bool start_array(std::size_t) override {
    next_token();
    if (frames_.empty()) {
      return fail("", "an object is expected, got a list");
    }
    if (!take_target()) {
      return false;
    }
    const bool in_list = frames_.back().kind == Frame::Kind::list;
    if (field_->is_repeated() && !in_list) {
      frames_.push_back({Frame::Kind::list, target_, field_, path_, {}, 0});
      return true;
    }
    if (field_->cpp_type() != pb::FieldDescriptor::CPPTYPE_MESSAGE || !is_number_tuple(*field_->message_type())) {
      return wrong_type("a list");
    }
    frames_.push_back({Frame::Kind::tuple, open_message(), nullptr, path_, {}, 0});
    return true;
  }
  bool end_array() override {
    const Frame& frame = frames_.back();
    if (frame.kind == Frame::Kind::tuple && frame.index != frame.message->GetDescriptor()->field_count()) {
      return fail_at(source_.place(frame.path), frame.path, "{} numbers [{}] are expected, got {}",
                     frame.message->GetDescriptor()->field_count(), field_names(*frame.message->GetDescriptor()),
                     frame.index);
    }
    return close();
  }

  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& error) override {
    next_token();
    token_ = std::min(token_, static_cast<std::size_t>(reached_ - text_.data()));
    const std::string_view rest = text_.substr(token_);
    for (const std::string_view name : {"NaN", "nan", "Infinity", "-Infinity", "inf", "-inf", "-NaN", "-nan"}) {
      if (rest.starts_with(name)) {
        return fail(current_path(), "{} is not a finite number", name);
      }
    }
    if (error.id == 406) {
      const std::string_view number = rest.substr(0, rest.find_first_of(",]} \t\r\n"));
      return fail(current_path(), "{} is too large for a number", cut_text(std::string(number), 40));
    }
    if (text_.find_first_not_of(" \t\r\n") == std::string_view::npos) {
      return fail("", "the file is empty");
    }
    const std::string_view read(text_.data(), static_cast<std::size_t>(reached_ - text_.data()));
    if (read.ends_with('}') || read.ends_with(']')) {
      const std::size_t bracket = read.size() - 1;
      const std::size_t before = read.substr(0, bracket).find_last_not_of(" \t\r\n");
      if (before != std::string_view::npos && read[before] == ',') {
        token_ = bracket;
        return fail("", "not JSON: a comma before {}. Remove it", read[bracket]);
      }
    }
    return fail("", "not JSON: {}", json_fault(error.what()).what);
  }

 private:
  static constexpr std::size_t kMaxDepth = 64;

  /// One open bracket.
  struct Frame {
    enum class Kind { fields, list, tuple };
    Kind kind;
    pb::Message* message;              ///< whose fields are read
    const pb::FieldDescriptor* field;  ///< the field whose value comes next
    std::string path;
    std::vector<const pb::FieldDescriptor*> seen;
    int index;  ///< index of the next element
  };

  /// Finds the beginning of the token that the parser has just read. It follows the previous token and its separators.
  void next_token() {
    const char* const end = text_.data() + text_.size();
    const char* at = previous_;
    while (at < end && std::string_view(" \t\r\n,:]}").find(*at) != std::string_view::npos) {
      ++at;
    }
    token_ = static_cast<std::size_t>(at - text_.data());
    previous_ = std::max(reached_, at);
  }

  /// Finds the message, field and path of the next value.
  bool take_target() {
    if (frames_.empty()) {
      return fail("", "an object is expected");
    }
    Frame& frame = frames_.back();
    target_ = frame.message;
    path_ = frame.path;
    if (frame.kind == Frame::Kind::tuple) {
      const pb::Descriptor& type = *frame.message->GetDescriptor();
      if (frame.index >= type.field_count()) {
        return fail_at(source_.place(frame.path), frame.path, "{} numbers [{}] are expected, got more",
                       type.field_count(), field_names(type));
      }
      field_ = type.field(frame.index);
      path_ += fmt::format("[{}]", frame.index++);
    } else if (frame.kind == Frame::Kind::list) {
      if (static_cast<std::size_t>(frame.index) >= kMaxSceneEntries) {  // checked before they take memory
        return fail_at(source_.place(frame.path), frame.path, "at most {} are possible, got more", kMaxSceneEntries);
      }
      field_ = frame.field;
      path_ += fmt::format("[{}]", frame.index++);
    } else {
      field_ = frame.field;
      path_ += (path_.empty() ? "" : ".") + field_->name();
    }
    source_.add(path_, token_);
    return true;
  }

  /// Like take_target, for a value that is not a list.
  bool take_scalar(std::string_view got) {
    if (!take_target()) {
      return false;
    }
    if (field_->is_repeated() && frames_.back().kind != Frame::Kind::list) {
      return fail(path_, "a list is expected, got {}", got);
    }
    return true;
  }

  pb::Message* open_message() const {
    const pb::Reflection& reflection = *target_->GetReflection();
    return field_->is_repeated() ? reflection.AddMessage(target_, field_) : reflection.MutableMessage(target_, field_);
  }

  bool number(double value, bool integer, const std::string& text) {
    if (!take_scalar(text)) {
      return false;
    }
    const pb::Reflection& reflection = *target_->GetReflection();
    switch (field_->cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_DOUBLE:
        field_->is_repeated() ? reflection.AddDouble(target_, field_, value)
                              : reflection.SetDouble(target_, field_, value);
        return true;
      case pb::FieldDescriptor::CPPTYPE_FLOAT:
        if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) {
          return fail(path_, "{} is too large for a single-precision number", text);
        }
        reflection.SetFloat(target_, field_, static_cast<float>(value));
        return true;
      case pb::FieldDescriptor::CPPTYPE_INT32:
        if (!integer) {
          return wrong_type(text);
        }
        if (std::abs(value) > std::numeric_limits<std::int32_t>::max()) {
          return fail(path_, "{} is too large for an integer of 32 bits", text);
        }
        reflection.SetInt32(target_, field_, static_cast<std::int32_t>(value));
        return true;
      default:
        return wrong_type(text);
    }
  }

  bool close() {
    frames_.pop_back();
    previous_ = std::max(previous_, reached_);
    return true;
  }

  bool wrong_type(std::string_view got) { return fail(path_, "{}, got {}", expected_of(*field_), got); }

  /// The path of the field that is being read, as far as it is known.
  std::string current_path() const {
    if (frames_.empty()) {
      return "";
    }
    const Frame& frame = frames_.back();
    if (frame.kind != Frame::Kind::fields) {
      return fmt::format("{}[{}]", frame.path, frame.index);
    }
    const std::string name = frame.field == nullptr ? "" : frame.field->name();
    return frame.path.empty() ? name : frame.path + "." + name;
  }

  template <class... Args>
  bool fail(const std::string& path, fmt::format_string<Args...> format, Args&&... args) {
    return fail_at(source_.place_of_offset(token_), path, format, std::forward<Args>(args)...);
  }
  template <class... Args>
  bool fail_at(const std::string& place, const std::string& path, fmt::format_string<Args...> format, Args&&... args) {
    status_ = invalid_argument("{}: {}{}{}", place, path, path.empty() ? "" : ": ",
                               fmt::format(format, std::forward<Args>(args)...));
    return false;
  }

  std::string_view text_;
  const char* reached_;    ///< how far the parser has read: past the token, and one more character after numbers
  const char* previous_;   ///< end of the previous token
  std::size_t token_ = 0;  ///< begin of the token
  pb::Message& root_;
  SourceMap& source_;
  std::vector<Frame> frames_;
  pb::Message* target_ = nullptr;
  const pb::FieldDescriptor* field_ = nullptr;
  std::string path_;
  Status status_;
};

}  // namespace

Status read_json(std::string_view text, google::protobuf::Message& message, SourceMap& source) {
  return JsonReader(text, message, source).read();
}

}  // namespace lightmill
