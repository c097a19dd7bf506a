//! A bound of the stack of a firmware image, from its disassembly: what each function puts on the stack, along the
//! deepest path of calls. The bound needs no run, so it also covers what no picture of the tests has reached.
//!
//! A call through a pointer may lead to every function whose address is in the image. Recursion is an error.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

/// Bytes that an exception puts on the stack: the eight core registers, eighteen words of the floating-point unit, and
/// up to four bytes for the alignment.
const EXCEPTION_BYTES: u32 = 8 * 4 + 18 * 4 + 4;
/// The function that a reset calls.
const RESET: &str = "Reset";

/// A function of the image.
#[derive(Debug, Default)]
struct Function {
    name: String,
    /// Sum of all that the function puts on the stack. At each of its calls, it has at most this on the stack.
    frame_bytes: u32,
    /// Addresses of the functions that are called or jumped to.
    calls: BTreeSet<u32>,
    calls_pointer: bool,
}

/// The deepest path of calls.
#[derive(Debug)]
pub struct StackBound {
    /// Bytes from the start of the program on, and of the deepest handler of an exception on top of it.
    pub bytes: u32,
    /// Part of `bytes` that belongs to the exception. Zero if the image has no handlers but the one of faults.
    pub exception_bytes: u32,
    /// Functions of the path, each with its bytes.
    pub path: Vec<(String, u32)>,
}

/// Returns the bound of an image for a Cortex-M.
///
/// # Errors
/// The image cannot be disassembled, an instruction changes the stack pointer in an unknown way, a function calls
/// itself, or there is no reset handler.
pub fn stack_bound(image: &Path) -> Result<StackBound, String> {
    let graph = Graph::read(image)?;
    let start = graph.functions.iter().find(|(_, f)| f.name == RESET).ok_or("the image has no reset handler")?;
    let (bytes, path) = graph.deepest(*start.0, &mut Vec::new()).map_err(|e| e.to_string())?;
    // A handler may interrupt the deepest place. Handlers of equal priority do not interrupt each other, and every port
    // leaves all of them at the priority of the reset.
    let mut exception_bytes = 0;
    for handler in &graph.handlers {
        let (own, _) = graph.deepest(*handler, &mut Vec::new()).map_err(|e| e.to_string())?;
        exception_bytes = exception_bytes.max(own + EXCEPTION_BYTES);
    }
    let name = |at: u32| (graph.functions[&at].name.clone(), graph.functions[&at].frame_bytes);
    Ok(StackBound { bytes: bytes + exception_bytes, exception_bytes, path: path.into_iter().map(name).collect() })
}

/// The functions of an image and their calls.
struct Graph {
    functions: BTreeMap<u32, Function>,
    /// Functions whose address is in the image, besides the vectors.
    pointed: BTreeSet<u32>,
    /// Handlers of interrupts and of exceptions other than the reset and the faults, which do not return.
    handlers: BTreeSet<u32>,
}

impl Graph {
    fn read(image: &Path) -> Result<Self, String> {
        let code = objdump(image, &["-d", "-C", "--no-show-raw-insn"])?;
        let mut functions = functions(&code, &sizes(&objdump(image, &["-t"])?))?;
        let starts: BTreeSet<u32> = functions.keys().copied().collect();
        for (start, function) in &mut functions {
            // A branch inside of a function is no call.
            let owners = function.calls.iter().filter_map(|at| starts.range(..=*at).next_back().copied());
            function.calls = owners.filter(|owner| owner != start).collect();
        }
        let is_function = |word: &u32| word & 1 == 1 && starts.contains(&(word & !1));
        let addresses = |words: BTreeSet<u32>| words.into_iter().filter(is_function).map(|word| word & !1).collect();
        let vectors = words(&objdump(image, &["-s", "-j", ".vector_table"])?);
        let mut data = words(&objdump(image, &["-s", "-j", ".rodata", "-j", ".data"])?);
        data.extend(addresses_in_code(&code));
        // The first two vectors are the stack and the reset.
        let handlers = addresses(vectors.into_iter().skip(2).collect());
        Ok(Self { functions, pointed: addresses(data.into_iter().collect()), handlers })
    }

    /// Returns the bytes of the deepest path that begins with a call of the function at `start`. `above` has the
    /// functions that have led to it.
    fn deepest(&self, start: u32, above: &mut Vec<u32>) -> Result<(u32, Vec<u32>), Recursion> {
        let function = &self.functions[&start];
        if let Some(place) = above.iter().position(|at| *at == start) {
            return Err(Recursion { name: function.name.clone(), place });
        }
        above.push(start);
        let running = above.len();
        let mut deepest = (0, Vec::new());
        let mut take = |below: (u32, Vec<u32>)| {
            if below.0 > deepest.0 {
                deepest = below;
            }
        };
        for at in &function.calls {
            take(self.deepest(*at, above)?);
        }
        for at in self.pointed.iter().filter(|_| function.calls_pointer) {
            match self.deepest(*at, above) {
                Ok(below) => take(below),
                // A function that leads back to one that runs already is not called by this pointer: hzn has no
                // recursion.
                Err(recursion) if recursion.place < running => above.truncate(running),
                Err(recursion) => return Err(recursion),
            }
        }
        above.pop();
        deepest.1.insert(0, start);
        Ok((deepest.0 + function.frame_bytes, deepest.1))
    }
}

/// A function calls itself.
#[derive(Debug)]
struct Recursion {
    name: String,
    /// Place of its first call among the functions that have led to the second one.
    place: usize,
}

impl core::fmt::Display for Recursion {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} calls itself", self.name)
    }
}

fn objdump(image: &Path, options: &[&str]) -> Result<String, String> {
    let run = Command::new("arm-none-eabi-objdump").args(options).arg(image).output();
    let output = run.map_err(|e| format!("arm-none-eabi-objdump cannot be run: {e}"))?;
    String::from_utf8(output.stdout).map_err(|_| format!("{}: the disassembly is no text", image.display()))
}

/// Returns the bytes of each function, by its address, from a list of symbols.
fn sizes(symbols: &str) -> BTreeMap<u32, u32> {
    let size = |line: &str| {
        let (head, tail) = line.split_once('\t')?;
        let is_code = head.ends_with(".text") && head.contains(" F ");
        let start = u32::from_str_radix(head.split(' ').next()?, 16).ok()?;
        let bytes = u32::from_str_radix(tail.split(' ').next()?, 16).ok()?;
        is_code.then_some((start, bytes)).filter(|_| bytes > 0)
    };
    symbols.lines().filter_map(size).collect()
}

/// Reads the functions of a disassembly. After the end of a function come bytes that fill the gap to the next one.
fn functions(code: &str, sizes: &BTreeMap<u32, u32>) -> Result<BTreeMap<u32, Function>, String> {
    let (constants, mut functions) = (constants_in_code(code), BTreeMap::new());
    let mut current = None;
    let mut moved = Moved::default();
    for line in code.lines() {
        if let Some((start, name)) = line.strip_suffix(">:").and_then(|l| l.split_once(" <")) {
            let start = u32::from_str_radix(start, 16).map_err(|e| format!("{line}: {e}"))?;
            current = Some(start);
            functions.insert(start, Function { name: name.to_owned(), ..Function::default() });
        } else if let Some((at, instruction)) = line.split_once(":\t")
            && let (Ok(at), Some(start)) = (u32::from_str_radix(at.trim(), 16), current)
            && sizes.get(&start).is_none_or(|bytes| at < start + bytes)
            && let Some(function) = functions.get_mut(&start)
        {
            let (name, operands) = instruction.split_once('\t').unwrap_or((instruction, ""));
            let known = moved.follow(name, operands, &constants);
            function.frame_bytes += known.unwrap_or(0);
            if known.is_some() {
                continue;
            }
            function.add(name, operands).map_err(|what| format!("{}: {what}: {instruction}", function.name))?;
        }
    }
    Ok(functions)
}

/// A register from which a Cortex-M0+ sets its stack pointer: it has no constant of more than 508 bytes in an
/// instruction.
#[derive(Debug, Default)]
struct Moved(Option<(String, Value)>);

/// What the register has.
#[derive(Debug, Clone, Copy)]
enum Value {
    /// A constant of the code.
    Constant(u32),
    /// The frame pointer r7 minus the registers that were pushed after it was set: the stack pointer as it was before.
    Before,
}

impl Moved {
    /// Follows the register through an instruction. Returns the bytes by which the instruction moves the stack pointer
    /// down by means of the register; `None` if it does not use it.
    fn follow(&mut self, name: &str, operands: &str, constants: &BTreeMap<u32, u32>) -> Option<u32> {
        let (to, from) = operands.split_once(", ")?;
        if to == "sp" && matches!(name, "add" | "mov") {
            let (register, value) = self.0.take()?;
            return match value {
                Value::Constant(bytes) if name == "add" && from == register => {
                    Some((bytes as i32).min(0).unsigned_abs())
                }
                Value::Before if name == "mov" && from == register => Some(0),
                _ => None,
            };
        }
        let constant = || {
            let at = from.strip_prefix("[pc, ")?.split_once("@ (")?.1.split(' ').next()?;
            constants.get(&u32::from_str_radix(at, 16).ok()?).copied()
        };
        match (name, &self.0) {
            ("subs", _) if from.starts_with("r7, #") => self.0 = Some((to.to_owned(), Value::Before)),
            ("subs", Some((register, Value::Before))) if register == to && from.starts_with('#') => {}
            ("ldr", _) => self.0 = constant().map(|bytes| (to.to_owned(), Value::Constant(bytes))),
            (_, Some((register, _))) if register == to => self.0 = None,
            _ => {}
        }
        None
    }
}

/// Returns the words between the functions, by their addresses.
fn constants_in_code(code: &str) -> BTreeMap<u32, u32> {
    let word = |line: &str| {
        let (at, value) = line.split_once(":\t.word\t")?;
        let number = |text: &str| u32::from_str_radix(text.trim().trim_start_matches("0x"), 16).ok();
        Some((number(at)?, number(value)?))
    };
    code.lines().filter_map(word).collect()
}

impl Function {
    fn add(&mut self, name: &str, operands: &str) -> Result<(), String> {
        let operands = operands.split(['@', ';']).next().unwrap_or_default().trim();
        let base = name.split('.').next().unwrap_or(name);
        match base {
            "push" | "vpush" => self.frame_bytes += list_bytes(operands)?,
            "stmdb" | "vstmdb" if operands.starts_with("sp!") => self.frame_bytes += list_bytes(operands)?,
            "sub" | "subw" if operands.starts_with("sp,") => self.frame_bytes += constant(operands)?,
            // Store with the address written back, for example `str lr, [sp, #-4]!`.
            "str" | "strd" | "vstr" if operands.contains("[sp, #-") && operands.ends_with("]!") => {
                self.frame_bytes += constant(operands.trim_end_matches("]!").trim_start_matches(|c| c != '#'))?;
            }
            "blx" | "bx" if !operands.contains("lr") => self.calls_pointer = true,
            "pop" | "vpop" | "ldmia" | "vldmia" | "add" | "addw" | "ldr" | "ldrd" => {}
            // Stores and comparisons read the stack pointer.
            "stmia" | "vstmia" | "cmp" => {}
            _ if operands.starts_with("sp,") || operands.starts_with("sp!") => {
                return Err("changes the stack pointer in an unknown way".into());
            }
            "mov" | "ldm" if operands.starts_with("pc") => self.calls_pointer = true,
            _ => {}
        }
        if (base.starts_with('b') || base.starts_with("cb"))
            && let Some((before, _)) = operands.split_once(" <")
            && let Some(target) = before.rsplit(' ').next()
            && let Ok(target) = u32::from_str_radix(target, 16)
        {
            self.calls.insert(target);
        }
        Ok(())
    }
}

/// Returns the bytes of a list of registers, for example `{r4, r5, lr}` or `{d8-d11}`.
fn list_bytes(operands: &str) -> Result<u32, String> {
    let list = operands.split_once('{').and_then(|(_, l)| l.strip_suffix('}')).ok_or("has no list of registers")?;
    let number = |register: &str| register.get(1..).and_then(|n| n.parse::<u32>().ok());
    let bytes = |item: &str| -> Result<u32, String> {
        let each = if item.starts_with('d') { 8 } else { 4 };
        let Some((first, last)) = item.split_once('-') else { return Ok(each) };
        let range = number(first).zip(number(last)).ok_or("has a range of registers that cannot be read")?;
        Ok(each * (range.1 - range.0 + 1))
    };
    list.split(',').map(|item| bytes(item.trim())).sum()
}

/// Returns the number after the last `#`, without its sign.
fn constant(operands: &str) -> Result<u32, String> {
    let text = operands.rsplit_once('#').map_or("", |(_, n)| n.trim().trim_start_matches('-'));
    text.parse().map_err(|_| "moves the stack pointer by an unknown amount".into())
}

/// Returns the words of sections that objdump shows in hexadecimal, in their order.
fn words(dump: &str) -> Vec<u32> {
    let lines = dump.lines().filter(|line| line.starts_with(' '));
    let groups = lines.flat_map(|line| line.split_whitespace().skip(1).take(4));
    groups.filter(|g| g.len() == 8).filter_map(|g| u32::from_str_radix(g, 16).ok()).map(u32::swap_bytes).collect()
}

/// Returns the addresses that the code has as words between its functions, or builds by pairs of `movw` and `movt`.
fn addresses_in_code(code: &str) -> BTreeSet<u32> {
    let mut low = BTreeMap::new();
    let mut addresses = BTreeSet::new();
    for line in code.lines() {
        let mut parts = line.split('\t').skip(1);
        let (Some(name), Some(operands)) = (parts.next(), parts.next()) else { continue };
        if name == ".word" {
            addresses.extend(u32::from_str_radix(operands.trim_start_matches("0x"), 16));
        }
        let Some((register, value)) = operands.split_once(", #") else { continue };
        let value = value.split_whitespace().next().and_then(|v| v.parse::<u32>().ok());
        match (name, value) {
            ("movw", Some(value)) => drop(low.insert(register.to_owned(), value)),
            ("movt", Some(value)) => drop(low.get(register).map(|low| addresses.insert(value << 16 | low))),
            _ => {}
        }
    }
    addresses
}

#[cfg(test)]
mod tests {
    use super::*;

    const CODE: &str = "
00000100 <Reset>:
     100:\tpush\t{r4, r5, r7, lr}
     102:\tsub.w\tsp, sp, #1024\t@ 0x400
     106:\tbl\t200 <low>
     10a:\tmovw\tr2, #769\t@ 0x301
     10e:\tmovt\tr2, #0
     112:\tblx\tr2
     114:\tb.n\t106 <Reset+0x6>
     118:\t.word\t0x0800be1d

00000200 <low>:
     200:\tstmdb\tsp!, {r8, r9, sl, fp}
     204:\tvpush\t{d8-d9}
     208:\tstr.w\tlr, [sp, #-8]!
     20c:\tcbz\tr0, 300 <closure>
     20e:\tbx\tlr

00000300 <closure>:
     300:\tvpush\t{d8}
     304:\tldmia.w\tsp!, {r7, pc}
     308:\tbmi.n\t200 <low>
";

    #[test]
    fn the_deepest_path_is_found() {
        let functions = functions(CODE, &sizes("00000300 l     F .text\t00000008 closure\n")).unwrap();
        let frames: Vec<u32> = functions.values().map(|f| f.frame_bytes).collect();
        assert_eq!(frames, [16 + 1024, 16 + 16 + 8, 8]);
        assert!(functions[&0x100].calls_pointer && !functions[&0x200].calls_pointer);
        assert_eq!(addresses_in_code(CODE), [0x301, 0x0800_be1d].into());
        let (pointed, handlers) = ([0x300].into(), BTreeSet::new());
        let mut graph = Graph { functions, pointed, handlers };
        // The branch of Reset into itself is no call: `Graph::read` removes it, so this test has to.
        graph.functions.get_mut(&0x100).unwrap().calls.remove(&0x106);
        let (bytes, path) = graph.deepest(0x100, &mut Vec::new()).unwrap();
        assert_eq!((bytes, path), (1040 + 40 + 8, vec![0x100, 0x200, 0x300]));
        // A pointer does not lead back to a function that runs, but a call does.
        graph.functions.get_mut(&0x300).unwrap().calls.insert(0x100);
        assert_eq!(graph.deepest(0x100, &mut Vec::new()).unwrap_err().to_string(), "Reset calls itself");
        graph.functions.get_mut(&0x200).unwrap().calls.clear();
        assert_eq!(graph.deepest(0x100, &mut Vec::new()).unwrap().0, 1040 + 40);
        graph.functions.get_mut(&0x200).unwrap().calls.insert(0x300);
        graph.functions.get_mut(&0x300).unwrap().calls = [0x200].into();
        assert_eq!(graph.deepest(0x100, &mut Vec::new()).unwrap_err().to_string(), "low calls itself");
    }

    #[test]
    fn unknown_changes_of_the_stack_pointer_are_errors() {
        let with =
            |instruction: &str| functions(&format!("00000100 <Reset>:\n     100:\t{instruction}\n"), &BTreeMap::new());
        assert!(with("mov\tsp, r4").unwrap_err().contains("Reset: changes the stack pointer in an unknown way"));
        assert!(with("sub\tsp, r4").unwrap_err().contains("by an unknown amount"));
        assert!(with("stmia.w\tsp, {r0, r1}").is_ok());
    }

    #[test]
    fn frames_of_a_cortex_m0_are_constants_of_the_code() {
        let code = "
00000100 <large>:
     100:\tpush\t{r4, r5, r6, r7, lr}
     102:\tadd\tr7, sp, #12
     104:\tldr\tr6, [pc, #16]\t@ (118 <large+0x18>)
     106:\tadd\tsp, r6
     108:\tbl\t200 <low>
     10c:\tsubs\tr6, r7, #7
     10e:\tsubs\tr6, #5
     110:\tmov\tsp, r6
     112:\tpop\t{r4, r5, r6, r7, pc}
     118:\t.word\t0xfffff064
";
        assert_eq!(functions(code, &BTreeMap::new()).unwrap()[&0x100].frame_bytes, 20 + 0xf9c);
        let other = code.replace("mov\tsp, r6", "mov\tsp, r5");
        assert!(functions(&other, &BTreeMap::new()).unwrap_err().contains("large: changes the stack pointer"));
    }

    #[test]
    fn words_of_a_dump_are_read() {
        let dump = "\nContents of section .rodata:\n 08000010 1dbe0008 01040008                    ........\n";
        assert_eq!(words(dump), [0x0800_be1d, 0x0800_0401]);
    }
}
