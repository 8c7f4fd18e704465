#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/message_decoder.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::size_t kCdrHeader = 4;        // bytes
constexpr std::size_t kListedElements = 36;  // elements of a fixed array; a covariance has 36

void add_fields(const MessageType& type, const std::string& prefix, std::vector<RecordedField>& fields) {
  for (const MessageMember& member : type.members) {
    const bool array = member.array != MessageMember::Array::none;
    std::size_t count = 1;
    if (member.array == MessageMember::Array::fixed && member.type != Primitive::message)
      count = std::min(member.length, kListedElements);
    for (std::size_t i = 0; i < count; ++i) {
      const std::string name = prefix + member.name + (array ? fmt::format("[{}]", i) : "");
      if (member.type == Primitive::message)
        add_fields(*member.message, name + ".", fields);
      else if (!member.name.starts_with("_padding"))
        fields.push_back(
            {name, member.type == Primitive::time || member.type == Primitive::duration ? "s" : member.unit});
    }
  }
}

}  // namespace

std::vector<RecordedField> fields_of(const MessageType& type) {
  std::vector<RecordedField> fields;
  add_fields(type, "", fields);
  return fields;
}

MessageDecoder::MessageDecoder(std::shared_ptr<const MessageType> type, MessageEncoding encoding,
                               const std::vector<std::string>& fields)
    : type_(std::move(type)), encoding_(encoding), values_(fields.size()) {
  for (std::size_t i = 0; i < fields.size(); ++i) want(*type_, fields[i], static_cast<int>(i), wanted_, fields[i]);
  for (std::size_t m = 0; m < wanted_.members.size(); ++m)
    if (!wanted_.members[m].empty()) end_ = m + 1;
}

void MessageDecoder::want(const MessageType& type, std::string_view path, int slot, Node& node,
                          const std::string& field) {
  const std::size_t end = path.find_first_of(".[");
  const std::string_view name = path.substr(0, end);
  path = end == std::string_view::npos ? std::string_view() : path.substr(end);
  const auto member =
      std::find_if(type.members.begin(), type.members.end(), [&](const MessageMember& m) { return m.name == name; });
  if (member == type.members.end()) throw Error(fmt::format("{} has no field {}", type_->name, quote(field)));
  std::size_t element = 0;
  if (path.starts_with('[')) {
    const std::size_t close = path.find(']');
    const std::string_view index = close == std::string_view::npos ? "" : path.substr(1, close - 1);
    if (index != "0") {
      const auto number = parse_positive_integer(index);
      if (!number) throw Error(fmt::format("{}: {} has no valid index", type_->name, quote(field)));
      element = static_cast<std::size_t>(*number);
    }
    path = path.substr(close + 1);
  }
  node.members.resize(type.members.size());
  std::vector<Branch>& branches = node.members[static_cast<std::size_t>(member - type.members.begin())];
  const bool leaf = member->type != Primitive::message;
  if (leaf != path.empty()) throw Error(fmt::format("{} has no field {}", type_->name, quote(field)));
  if (leaf) {
    branches.push_back({element, slot});
    return;
  }
  auto branch =
      std::find_if(branches.begin(), branches.end(), [&](const Branch& b) { return b.nested && b.element == element; });
  if (branch == branches.end()) branch = branches.insert(branch, {element, -1, std::make_unique<Node>()});
  want(*member->message, path.substr(1), slot, *branch->nested, field);
}

const std::vector<RecordedValue>& MessageDecoder::decode(std::string_view bytes) {
  std::fill(values_.begin(), values_.end(), RecordedValue());
  bool big_endian = false;
  if (encoding_ == MessageEncoding::cdr) {
    if (bytes.size() < kCdrHeader) throw OutOfBytes();
    const auto kind = static_cast<unsigned char>(bytes[1]);
    big_endian = kind % 2 == 0;
    max_align_ = kind >= 6 ? 4 : 8;  // XCDR2 aligns to 4 bytes at most
    bytes.remove_prefix(kCdrHeader);
  }
  ByteReader in(bytes, big_endian);
  read_message(in, *type_, &wanted_, end_);
  return values_;
}

void MessageDecoder::read_message(ByteReader& in, const MessageType& type, const Node* node, std::size_t end) {
  if (type.members.empty() && encoding_ == MessageEncoding::cdr) in.skip(1);  // an empty struct has a dummy byte
  for (std::size_t m = 0; m < end; ++m) {
    const std::vector<Branch>* wanted = node && !node->members[m].empty() ? &node->members[m] : nullptr;
    read_member(in, type.members[m], wanted);
  }
}

void MessageDecoder::read_member(ByteReader& in, const MessageMember& member, const std::vector<Branch>* wanted) {
  std::size_t count = 1;
  if (member.array == MessageMember::Array::fixed) count = member.length;
  if (member.array == MessageMember::Array::sequence) {
    align(in, Primitive::uint32);
    count = in.u32();
    if (count > in.remaining()) throw OutOfBytes();
  }
  if (!wanted) {
    skip_elements(in, member, count);
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Node* nested = nullptr;
    bool value = false;
    for (const Branch& branch : *wanted)
      if (branch.element == i) {
        nested = branch.nested.get();
        value = value || branch.slot >= 0;
      }
    if (member.type == Primitive::message) {
      read_message(in, *member.message, nested, member.message->members.size());
    } else if (!value) {
      skip_elements(in, member, 1);
    } else {
      const RecordedValue read = read_value(in, member);
      for (const Branch& branch : *wanted)
        if (branch.element == i) values_[static_cast<std::size_t>(branch.slot)] = read;
    }
  }
}

void MessageDecoder::skip_elements(ByteReader& in, const MessageMember& member, std::size_t count) {
  if (count == 0) return;
  if (member.type == Primitive::chars) {
    in.skip(count * member.length);
  } else if (const std::size_t size = size_of(member.type)) {
    align(in, member.type);
    in.skip(count * size);
  } else {
    for (std::size_t i = 0; i < count; ++i)
      if (member.type == Primitive::message)
        read_message(in, *member.message, nullptr, member.message->members.size());
      else
        read_value(in, member);
  }
}

void MessageDecoder::align(ByteReader& in, Primitive type) const {
  if (encoding_ != MessageEncoding::cdr) return;
  const bool pair = type == Primitive::time || type == Primitive::duration;
  const std::size_t size = type == Primitive::string ? 4 : pair ? 4 : size_of(type);
  if (size > 1) in.align(std::min(size, max_align_));
}

RecordedValue MessageDecoder::read_value(ByteReader& in, const MessageMember& member) {
  align(in, member.type);
  const auto number = [&](auto value) { return RecordedValue{member.factor * static_cast<double>(value)}; };
  switch (member.type) {
    case Primitive::boolean:
    case Primitive::uint8:
      return number(in.u8());
    case Primitive::int8:
      return number(in.number<std::int8_t>());
    case Primitive::int16:
      return number(in.number<std::int16_t>());
    case Primitive::uint16:
      return number(in.u16());
    case Primitive::int32:
      return number(in.number<std::int32_t>());
    case Primitive::uint32:
      return number(in.u32());
    case Primitive::int64:
      return number(in.number<std::int64_t>());
    case Primitive::uint64:
      return number(in.u64());
    case Primitive::float32:
      return number(in.number<float>());
    case Primitive::float64:
      return number(in.number<double>());
    case Primitive::time: {
      const double seconds = encoding_ == MessageEncoding::cdr ? double(in.number<std::int32_t>()) : double(in.u32());
      return number(seconds + 1e-9 * in.u32());
    }
    case Primitive::duration: {
      const double seconds = in.number<std::int32_t>();
      return number(seconds + 1e-9 * in.number<std::int32_t>());
    }
    case Primitive::string: {
      std::string_view text = in.text32();
      if (text.ends_with('\0')) text.remove_suffix(1);
      return {std::numeric_limits<double>::quiet_NaN(), text};
    }
    case Primitive::chars: {
      const std::string_view text = in.take(member.length);
      return {std::numeric_limits<double>::quiet_NaN(), text.substr(0, text.find('\0'))};
    }
    case Primitive::message:
      break;
  }
  return {};
}

}  // namespace tandem
