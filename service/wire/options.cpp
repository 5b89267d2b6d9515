#include "wire/options.h"

#include <cstdint>
#include <string>
#include <type_traits>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/unknown_field_set.h>

#include "rcs/error.h"
#include "rcs/option_table.h"

namespace rcs::service {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

/// Which message within RenderOptions holds an option's field: that of the settings, or itself.
template <typename Options>
auto& message_of(const OptionInfo& option, Options& options)
{
    const bool in_settings = std::holds_alternative<int QualitySettings::*>(option.field) ||
                             std::holds_alternative<float QualitySettings::*>(option.field);
    if constexpr (std::is_const_v<Options>) {
        return in_settings ? static_cast<const Message&>(options.settings()) : options;
    } else {
        return in_settings ? static_cast<Message&>(*options.mutable_settings()) : options;
    }
}

const FieldDescriptor& field_of(const OptionInfo& option, const Message& message)
{
    const FieldDescriptor* field = message.GetDescriptor()->FindFieldByName(std::string(option.key));
    if (field == nullptr)
        throw Error(ErrorCode::internal, message.GetTypeName() + " has no field " + std::string(option.key));
    return *field;
}

/// A message, one of its fields, and what reads and writes it.
template <typename Holder>
struct Place {
    Holder& message;
    const FieldDescriptor& field;
    const Reflection& by = *message.GetReflection();
};

void write(const Place<Message>& at, int value) { at.by.SetInt32(&at.message, &at.field, value); }
void write(const Place<Message>& at, float value) { at.by.SetFloat(&at.message, &at.field, value); }
void write(const Place<Message>& at, double value) { at.by.SetDouble(&at.message, &at.field, value); }
void write(const Place<Message>& at, std::uint64_t value) { at.by.SetUInt64(&at.message, &at.field, value); }
template <typename Choice>
    requires std::is_enum_v<Choice>
void write(const Place<Message>& at, Choice value)
{
    at.by.SetEnumValue(&at.message, &at.field, static_cast<int>(value));
}
void write(const Place<Message>& at, const std::optional<double>& value)
{
    if (value) write(at, *value);
}
void write(const Place<Message>& at, const std::optional<Crop>& value)
{
    if (!value) return;
    for (const int number : {value->x, value->y, value->width, value->height})
        at.by.AddInt32(&at.message, &at.field, number);
}
void write(const Place<Message>& at, EffectSet value)
{
    for (std::size_t i = 0; i < kEffects; ++i) {
        const auto effect = static_cast<Effect>(i);
        if (value.has(effect)) at.by.AddString(&at.message, &at.field, std::string(name_of(effect)));
    }
}

void read(const Place<const Message>& at, int& value) { value = at.by.GetInt32(at.message, &at.field); }
void read(const Place<const Message>& at, float& value) { value = at.by.GetFloat(at.message, &at.field); }
void read(const Place<const Message>& at, double& value) { value = at.by.GetDouble(at.message, &at.field); }
void read(const Place<const Message>& at, std::uint64_t& value) { value = at.by.GetUInt64(at.message, &at.field); }
void read(const Place<const Message>& at, std::optional<double>& value)
{
    value = at.by.GetDouble(at.message, &at.field);
}
template <typename Choice>
    requires std::is_enum_v<Choice>
void read(const Place<const Message>& at, Choice& value)
{
    value = static_cast<Choice>(at.by.GetEnumValue(at.message, &at.field));
}

/// Lists are as on the command line.
void read_list(const OptionInfo& option, const Place<const Message>& at, RenderOptions& options)
{
    const bool numbers = at.field.cpp_type() == FieldDescriptor::CPPTYPE_INT32;
    std::string list;
    for (int i = 0; i < at.by.FieldSize(at.message, &at.field); ++i)
        list.append(i == 0 ? "" : ",")
            .append(numbers ? std::to_string(at.by.GetRepeatedInt32(at.message, &at.field, i))
                            : at.by.GetRepeatedString(at.message, &at.field, i));
    if (!list.empty()) set_from_text(option, options, list);
}

/// Meanings of an earlier version are not lost in silence: a job that was stored with them is refused.
void check_reserved(const v1::RenderOptions& message)
{
    const auto& unknown = message.GetReflection()->GetUnknownFields(message);
    for (int i = 0; i < unknown.field_count(); ++i) {
        const int number = unknown.field(i).number();
        if (message.GetDescriptor()->IsReservedNumber(number))
            throw Error(ErrorCode::bad_argument, "options has field " + std::to_string(number) +
                                                     ", which only protocol version 1 had; ask for the picture anew");
    }
}

}  // namespace

v1::RenderOptions to_message(const RenderOptions& options)
{
    v1::RenderOptions message;
    for (const OptionInfo& option : option_table()) {
        with_value(option, options, [&](const auto& value) {
            Message& holder = message_of(option, message);
            write({holder, field_of(option, holder)}, value);
        });
    }
    return message;
}

RenderOptions from_message(const v1::RenderOptions& message)
{
    check_reserved(message);
    RenderOptions options;
    if (message.has_settings()) options.quality = QualitySettings{};
    for (const OptionInfo& option : option_table()) {
        const Message& holder = message_of(option, message);
        const Place<const Message> at{holder, field_of(option, holder)};
        if (at.field.is_repeated()) {
            read_list(option, at, options);
        } else if (at.by.HasField(holder, &at.field)) {
            change_value(option, options, [&](auto& value) {
                if constexpr (requires { read(at, value); }) read(at, value);
            });
        }
    }
    validate(options);
    return options;
}

}  // namespace rcs::service
