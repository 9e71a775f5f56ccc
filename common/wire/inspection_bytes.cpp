#include "common/wire/inspection_bytes.h"

#include "common/wire/farm_messages.h"
#include "lightmill/v1/render_service.pb.h"

namespace lightmill {
namespace {

template <class Message, class Value>
std::string packed(const Value& value) {
  Message message;
  to_wire(value, &message);
  return message.SerializeAsString();
}

template <class Message>
auto unpacked(std::string_view bytes) -> decltype(from_wire(Message())) {
  Message message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return invalid_argument("{} bytes are not a valid {}", bytes.size(), Message::descriptor()->name());
  }
  return from_wire(message);
}

}  // namespace

std::string pack_request(const InspectionRequest& request) {
  return packed<v1::InspectSceneRequest>(request);
}

Result<InspectionRequest> unpack_request(std::string_view bytes) {
  return unpacked<v1::InspectSceneRequest>(bytes);
}

std::string pack_inspection(const Inspection& inspection) {
  return packed<v1::InspectSceneResponse>(inspection);
}

Result<Inspection> unpack_inspection(std::string_view bytes) {
  return unpacked<v1::InspectSceneResponse>(bytes);
}

}  // namespace lightmill
