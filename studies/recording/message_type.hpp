#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace tandem {

/// Type of a member of a message.
enum class Primitive {
  boolean,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  time,      ///< seconds and nanoseconds, each 32 bits
  duration,  ///< signed seconds and nanoseconds
  string,
  chars,  ///< a text of `length` bytes, padded with zeros
  message,
};

struct MessageType;

/// A member of a message: a primitive or another message, single or an array.
struct MessageMember {
  enum class Array { none, fixed, sequence };
  std::string name;
  Primitive type = Primitive::message;
  std::shared_ptr<const MessageType> message{};  ///< for Primitive::message
  Array array = Array::none;
  std::size_t length = 0;  ///< length of a fixed array, or of Primitive::chars
  double factor = 1;       ///< factor on numbers
  std::string unit{};      ///< stated unit after `factor`
};

/// The members of a message in the order of its bytes.
struct MessageType {
  std::string name;
  std::vector<MessageMember> members;
};

/// Parses the text of a ROS message definition, in which "===" lines and "MSG: NAME" precede the definitions of nested
/// messages. Throws Error on a type without a definition.
std::shared_ptr<const MessageType> parse_message_definition(const std::string& type, const std::string& text,
                                                            bool ros1);

/// Returns the definition of a common message with all nested ones, for bags that contain none; empty for others.
std::string builtin_definition(const std::string& type);

/// Returns "sensor_msgs/Imu" for "sensor_msgs/msg/Imu".
std::string short_type_name(std::string type);

/// Returns the size of a primitive [bytes]; 0 for string, chars and message.
std::size_t size_of(Primitive type);

}  // namespace tandem
