//! The notation of an entry: numbers in flight, limits and options.

/// Gives a number in flight, or `None` for `-`.
macro_rules! flight {
    (-) => {
        None::<u16>
    };
    ($id:literal) => {
        Some::<u16>($id)
    };
}

/// Gives the place of the number `id` among the numbers of a key.
macro_rules! place {
    // The use of the identifier avoids a warning for sections that have no number in flight.
    (-, $ty:ty, $id:ident) => {{
        let _ = $id;
        None::<u16>
    }};
    ($first:literal, $ty:ty, $id:ident) => {
        $id.checked_sub($first).filter(|place| *place < <$ty as $crate::base::keys::Value>::NUMBERS)
    };
}

/// Gives the feature of a choice.
macro_rules! feature_name {
    () => {
        None
    };
    ($feature:literal) => {
        Some($feature)
    };
}

/// Gives the text of one option among several.
// The wanted name is compared with the first option and the rest is searched again, because a macro cannot look up a
// name in a list.
macro_rules! option {
    ($wanted:ident) => { None };
    (needs needs $text:literal $($rest:tt)*) => { Some($text) };
    (unset unset $text:literal $($rest:tt)*) => { Some($text) };
    (example example $text:literal $($rest:tt)*) => { Some($text) };
    ($wanted:ident $other:ident $text:literal $($rest:tt)*) => { $crate::base::keys::option!($wanted $($rest)*) };
}

/// Gives [`Limits`] from their notation.
macro_rules! limits {
    ([choice]) => {
        $crate::base::keys::Limits::Choice
    };
    ([$rule:literal]) => {
        $crate::base::keys::Limits::Rule($rule)
    };
    ([above $low:literal]) => {
        $crate::base::keys::Limits::Number { low: $low, above: true, high: f64::INFINITY }
    };
    ([above $low:literal to $high:literal]) => {
        $crate::base::keys::Limits::Number { low: $low, above: true, high: $high }
    };
    ([$low:literal or more]) => {
        $crate::base::keys::Limits::Number { low: $low, above: false, high: f64::INFINITY }
    };
    ([$low:literal to $high:literal]) => {
        $crate::base::keys::Limits::Number { low: $low, above: false, high: $high }
    };
}

/// Checks one value; the section's own code checks a rule in words.
macro_rules! check {
    ($value:expr, $path:expr, [$rule:literal]) => {};
    ($value:expr, $path:expr, [choice]) => {
        $crate::base::keys::Value::check(&$value, $path, 0.0, false, 0.0)?
    };
    ($value:expr, $path:expr, [above $low:literal]) => {
        $crate::base::keys::Value::check(&$value, $path, $low, true, f64::INFINITY)?
    };
    ($value:expr, $path:expr, [above $low:literal to $high:literal]) => {
        $crate::base::keys::Value::check(&$value, $path, $low, true, $high)?
    };
    ($value:expr, $path:expr, [$low:literal or more]) => {
        $crate::base::keys::Value::check(&$value, $path, $low, false, f64::INFINITY)?
    };
    ($value:expr, $path:expr, [$low:literal to $high:literal]) => {
        $crate::base::keys::Value::check(&$value, $path, $low, false, $high)?
    };
}

/// Reads the value of a key from the bytes of a sensor.
macro_rules! unpack {
    // A large value is then made where it stays.
    ($from:ident, $ty:ty, $default:tt, [$rule:literal], { unset $unset:literal example $example:literal }) => {
        <$ty as $crate::base::packed::Packed>::unpack($from)
    };
    ($from:ident, $ty:ty, $default:tt, $limits:tt, { $($option:ident $text:literal)* }) => {{
        let value = <$ty as $crate::base::packed::Packed>::unpack($from);
        $crate::base::keys::limit!($from, value, $limits);
        $crate::base::keys::lacks!($from, value, $default, $($option $text)*);
        value
    }};
}

/// Refuses the bytes of a sensor if a value that was read from them is out of its limits.
macro_rules! limit {
    ($from:ident, $value:expr, [$rule:literal]) => {};
    ($from:ident, $value:expr, [choice]) => {};
    ($from:ident, $value:expr, [above $low:literal]) => {
        $crate::base::keys::Value::limit(&$value, $from, $low, true, f64::INFINITY)
    };
    ($from:ident, $value:expr, [above $low:literal to $high:literal]) => {
        $crate::base::keys::Value::limit(&$value, $from, $low, true, $high)
    };
    ($from:ident, $value:expr, [$low:literal or more]) => {
        $crate::base::keys::Value::limit(&$value, $from, $low, false, f64::INFINITY)
    };
    ($from:ident, $value:expr, [$low:literal to $high:literal]) => {
        $crate::base::keys::Value::limit(&$value, $from, $low, false, $high)
    };
}

/// Refuses the bytes of a sensor if a key needs a feature that is not in this build, and does not have its default.
macro_rules! lacks {
    ($from:ident, $value:expr, $default:tt, needs $feature:literal $($rest:tt)*) => {
        if !cfg!(feature = $feature) {
            $from.require($value == $default);
        }
    };
    ($from:ident, $value:expr, $default:tt, $option:ident $text:literal $($rest:tt)*) => {
        $crate::base::keys::lacks!($from, $value, $default, $($rest)*)
    };
    ($from:ident, $value:expr, $default:tt,) => {};
}

/// Checks that a key keeps its default when its feature is not in this build.
macro_rules! needs {
    ($value:expr, $default:tt, $path:expr, needs $feature:literal $($rest:tt)*) => {
        // The default passes without the feature, so that a file that writes out every key loads in every build.
        if !cfg!(feature = $feature) && $value != $default {
            return Err($crate::base::error::ConfigError::lacks($path, None, $feature));
        }
    };
    ($value:expr, $default:tt, $path:expr, $option:ident $text:literal $($rest:tt)*) => {
        $crate::base::keys::needs!($value, $default, $path, $($rest)*)
    };
    ($value:expr, $default:tt, $path:expr,) => {};
}

pub(crate) use {check, feature_name, flight, lacks, limit, limits, needs, option, place, unpack};
