import java.nio.file.Files;
import java.nio.file.Path;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.HexFormat;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import org.yamcs.ProcessorConfig;
import org.yamcs.YConfiguration;
import org.yamcs.mdb.Mdb;
import org.yamcs.mdb.MdbFactory;
import org.yamcs.mdb.MetaCommandProcessor;
import org.yamcs.mdb.ProcessorData;
import org.yamcs.mdb.XtceTmExtractor;
import org.yamcs.parameter.ParameterValue;
import org.yamcs.parameter.Value;
import org.yamcs.protobuf.Yamcs.Value.Type;
import org.yamcs.utils.TimeEncoding;
import org.yamcs.xtce.Argument;
import org.yamcs.xtce.CommandVerifier;
import org.yamcs.xtce.EnumeratedParameterType;
import org.yamcs.xtce.IntegerParameterType;
import org.yamcs.xtce.MetaCommand;
import org.yamcs.xtce.Parameter;

/**
 * Loads a dictionary into the mission database of Yamcs, as a server does with "type: xtce", and lists its alarms and
 * telecommands.
 *
 * <p>Arguments: DICTIONARY COMMANDS PACKETS FOLDER. COMMANDS has a line for each telecommand: its name and NAME=VALUE
 * for each argument, with tabs between them. PACKETS is a file of space packets without sync markers. FOLDER gets
 * commands.txt, a line of hexadecimal digits for each telecommand, and values.txt, a line for each packet: its
 * container and NAME=NUMBER for each number, with tabs between them; =TEXT follows where Yamcs shows something else.
 */
public class ListCommands {
    public static void main(String[] args) throws Exception {
        Path folder = Path.of(args[3]);
        TimeEncoding.setUp();
        Map<String, Object> loader = Map.of("type", "xtce", "args", Map.of("file", args[0]));
        Mdb mdb = MdbFactory.createInstance(List.of(YConfiguration.wrap(loader)), false, false);
        ProcessorData data = new ProcessorData("test", mdb, new ProcessorConfig());
        mdb.getParameters().forEach(ListCommands::listAlarm);
        mdb.getMetaCommands().forEach(ListCommands::list);
        Files.write(folder.resolve("commands.txt"), encode(mdb, data, Files.readAllLines(Path.of(args[1]))));
        Files.write(folder.resolve("values.txt"), decode(mdb, data, Files.readAllBytes(Path.of(args[2]))));
    }

    /** Prints the alarm of a parameter. */
    private static void listAlarm(Parameter parameter) {
        Object alarm = null;
        if (parameter.getParameterType() instanceof IntegerParameterType type) {
            alarm = type.getDefaultAlarm();
        } else if (parameter.getParameterType() instanceof EnumeratedParameterType type) {
            alarm = type.getDefaultAlarm();
        }
        if (alarm != null) {
            System.out.println("alarm " + parameter.getName() + " " + alarm.toString().strip());
        }
    }

    /** Prints a telecommand with its arguments and verifiers. */
    private static void list(MetaCommand command) {
        System.out.println("command " + command.getName());
        List<Argument> arguments = command.getArgumentList();
        for (Argument argument : arguments == null ? List.<Argument>of() : arguments) {
            // The type's own text has its size, its choices and its range.
            String initial = argument.getInitialValue() == null ? "" : ", initially " + argument.getInitialValue();
            System.out.println("  " + argument.getName() + ": " + argument.getArgumentType() + initial);
        }
        for (CommandVerifier verifier : command.getCommandVerifiers()) {
            System.out.println("  " + verifier.getStage() + " waits for " + verifier.getContainerRef().getName() + ", "
                    + verifier.getCheckWindow());
        }
    }

    /** Returns the bytes of telecommands, in hexadecimal digits. */
    private static List<String> encode(Mdb mdb, ProcessorData data, List<String> commands) throws Exception {
        List<String> lines = new ArrayList<>();
        for (String line : commands) {
            String[] words = line.split("\t");
            Map<String, Object> values = new LinkedHashMap<>();
            for (String word : List.of(words).subList(1, words.length)) {
                String[] pair = word.split("=", 2);
                values.put(pair[0], pair[1]);
            }
            MetaCommand command = mdb.getMetaCommand("/hzn/" + words[0]);
            byte[] packet = MetaCommandProcessor.buildCommand(data, command, values, 0).getCmdPacket();
            lines.add(HexFormat.of().formatHex(packet));
        }
        return lines;
    }

    /** Returns the numbers of packets. */
    private static List<String> decode(Mdb mdb, ProcessorData data, byte[] stream) {
        XtceTmExtractor extractor = new XtceTmExtractor(mdb, data);
        extractor.provideAll();
        List<String> lines = new ArrayList<>();
        int end;
        for (int at = 0; at < stream.length; at = end) {
            end = at + 7 + ((stream[at + 4] & 0xFF) << 8 | stream[at + 5] & 0xFF);
            var result = extractor.processPacket(Arrays.copyOfRange(stream, at, end), 0, 0, 0);
            var containers = result.getContainerResult();
            StringBuilder line = new StringBuilder(containers.get(containers.size() - 1).getContainer().getName());
            for (ParameterValue value : result.getParameterResult()) {
                String number = text(value.getRawValue());
                // A value that could not be converted has none.
                String shown = value.getEngValue() == null ? "invalid" : text(value.getEngValue());
                line.append('\t').append(value.getParameter().getName()).append('=').append(number);
                line.append(shown.equals(number) ? "" : "=" + shown);
            }
            lines.add(line.toString());
        }
        return lines;
    }

    /** Returns a value as text; the digits of a float are those of the same number in double precision. */
    private static String text(Value value) {
        return value.getType() == Type.FLOAT ? Double.toString(value.getFloatValue()) : value.toString();
    }
}
