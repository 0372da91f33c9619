-- gimbal_inverse : the joints' angles at which the tip is at a given position
--
--   x = -r*cos(pitch)*sin(roll)    y = r*cos(pitch)*cos(roll)    z = r*sin(pitch)
--
-- Three vectors are measured one after the other by one cordic of LENGTH_WIDTH+1
-- bits, which gives the hypot and the atan2 of each:
--   across = hypot(y, -x)    roll  = atan2(-x, y)
--   far    = hypot(across, z)  pitch = atan2(z, across)
--   LEAST = ROD_LENGTH - CRANK_LENGTH    MOST = ROD_LENGTH + CRANK_LENGTH
--   R = the nearest to far - OFFSET in LEAST .. MOST
--   P = floor((MOST - R) * (R + LEAST) / 2^DROP)
--   Q = floor((R - LEAST) * (R + MOST) / 2^DROP)
--   psi = atan2(floor(sqrt(4*P*Q)), Q - P)
-- This is the cosine rule without a division, because, but for the floors,
-- P + Q = 4*R*CRANK_LENGTH/2^DROP and cos(psi) = (Q - P)/(Q + P). DROP is the least
-- number with 4*CRANK_LENGTH*MOST < 2^(LENGTH_WIDTH+DROP).
--
--   pitch  := clamp(pitch, -LIMIT, LIMIT)    roll := clamp(roll, -LIMIT, LIMIT)
--   crank  := psi; where psi < 0 by rounding: 0 when psi >= -1/2, else all ones
--   radius := OFFSET + R
--   out_of_reach := 1 when a clamp changes pitch, roll or R, else 0
--
-- generics LENGTH_WIDTH      bits of lengths, 4 to 24
--          LENGTH_FRAC       their fraction bits, at most 30
--          CRANK_LENGTH, ROD_LENGTH, OFFSET  in units of 2^-LENGTH_FRAC m: lengths of
--                            the crank and of the longer rod, distance from the
--                            centre to the crank's axis
--          ANGLE_WIDTH       bits of angles, 3 to 24
--          LIMIT             of pitch and roll, in units of 2^-(ANGLE_WIDTH-1)
--          GUARD, ROTATIONS  of the cordic
-- in       start   (0,1,0)  begins, gives up what is under way
--          x, y, z (1,LENGTH_WIDTH-1-LENGTH_FRAC,LENGTH_FRAC) [m]  read with start
-- out      pitch, roll, crank (1,0,ANGLE_WIDTH-1) [half turn]
--          radius       (1,LENGTH_WIDTH-1-LENGTH_FRAC,LENGTH_FRAC) [m]
--          out_of_reach (0,1,0)  a joint is at its limit, the tip not at the target
--          busy         (0,1,0)  a computation is under way
--          ready        (0,1,0)  for one edge, together with new joints
-- latency  3*ROTATIONS + LENGTH_WIDTH + 13 edges from the edge with start to the
--          edge that writes the joints; a start on that edge too gives them up
-- reset    outputs 0, nothing under way
-- overflow none; at the origin pitch and roll are 0
-- source   Pediredla, Chandrasekaran, Annamraju, Thondiyath
-- differs from the hardware: a design of this project, the paper computes on a
--          host. The products take one edge, so no limit on the clock. The
--          emulator computes the joints at the start and shows them when they
--          are ready: the ports are exact at every edge, the registers of
--          CORDIC and root are not modelled.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity gimbal_inverse is
  generic (
    LENGTH_WIDTH : positive := 20;
    LENGTH_FRAC  : natural  := 22;
    CRANK_LENGTH : positive := 52429;
    ROD_LENGTH   : positive := 243270;
    OFFSET       : natural  := 0;
    ANGLE_WIDTH  : positive := 20;
    LIMIT        : positive := 160199;
    GUARD        : natural  := 4;
    ROTATIONS    : positive := 20
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    start        : in  std_logic;
    x            : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    y            : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    z            : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    pitch        : out std_logic_vector(ANGLE_WIDTH - 1 downto 0);
    roll         : out std_logic_vector(ANGLE_WIDTH - 1 downto 0);
    crank        : out std_logic_vector(ANGLE_WIDTH - 1 downto 0);
    radius       : out std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    out_of_reach : out std_logic;
    busy         : out std_logic;
    ready        : out std_logic
  );
end entity;

architecture rtl of gimbal_inverse is

  constant VECTOR_WIDTH : positive := LENGTH_WIDTH + 1;
  constant WIDE_WIDTH   : positive := 2 * LENGTH_WIDTH + 2;

  subtype vector_word is std_logic_vector(VECTOR_WIDTH - 1 downto 0);
  subtype angle_word  is std_logic_vector(ANGLE_WIDTH - 1 downto 0);
  subtype length_word is signed(LENGTH_WIDTH - 1 downto 0);
  subtype factor      is signed(VECTOR_WIDTH - 1 downto 0);
  subtype wide_word   is signed(WIDE_WIDTH - 1 downto 0);

  constant LEAST : positive := ROD_LENGTH - CRANK_LENGTH;
  constant MOST  : positive := ROD_LENGTH + CRANK_LENGTH;

  function drop return natural is
    variable room : real    := 2.0**LENGTH_WIDTH;
    variable bits : natural := 0;
  begin
    while 4.0 * real(CRANK_LENGTH) * real(MOST) >= room loop
      room := 2.0 * room;
      bits := bits + 1;
    end loop;
    return bits;
  end function;

  constant DROPPED : natural := drop;

  -- Between -LIMIT and LIMIT.
  function limited(angle : angle_word) return angle_word is
  begin
    if signed(angle) > LIMIT then
      return std_logic_vector(to_signed(LIMIT, ANGLE_WIDTH));
    elsif signed(angle) < -LIMIT then
      return std_logic_vector(to_signed(-LIMIT, ANGLE_WIDTH));
    end if;
    return angle;
  end function;

  -- The nearest of 0 and all ones for an angle that rounding has made negative.
  function within_half_turn(angle : angle_word) return angle_word is
    variable word : angle_word := angle;
  begin
    if angle(ANGLE_WIDTH - 1) = '1' then
      word := (others => not angle(ANGLE_WIDTH - 2));
      word(ANGLE_WIDTH - 1) := '0';
    end if;
    return word;
  end function;

  -- A length's negative; the least word has one in a vector's word.
  function negative(word : std_logic_vector) return vector_word is
  begin
    return std_logic_vector(-resize(signed(word), VECTOR_WIDTH));
  end function;

  function resized(word : std_logic_vector) return vector_word is
  begin
    return std_logic_vector(resize(signed(word), VECTOR_WIDTH));
  end function;

  -- floor(product / 2^DROPPED), as a word of LENGTH_WIDTH bits.
  function part(product : wide_word) return unsigned is
    variable bits : unsigned(WIDE_WIDTH + LENGTH_WIDTH - 1 downto 0);
  begin
    bits := resize(unsigned(product), bits'length);
    return bits(DROPPED + LENGTH_WIDTH - 1 downto DROPPED);
  end function;

  signal turn       : std_logic;
  signal extract    : std_logic;
  signal vector_x   : vector_word;
  signal vector_y   : vector_word;
  signal measured   : vector_word;
  signal angle      : angle_word;
  signal rotated    : std_logic;
  signal radicand   : std_logic_vector(2 * LENGTH_WIDTH - 1 downto 0);
  signal root       : std_logic_vector(LENGTH_WIDTH - 1 downto 0);
  signal rooted     : std_logic;
  signal far        : vector_word;
  signal folded     : unsigned(LENGTH_WIDTH - 1 downto 0);
  signal stretched  : unsigned(LENGTH_WIDTH - 1 downto 0);
  signal wanted     : signed(LENGTH_WIDTH + 2 downto 0);  -- far less the offset
  signal reach      : length_word;                        -- R
  signal folding    : wide_word;                          -- P before the floor
  signal stretching : wide_word;                          -- Q before the floor
  signal quarter    : wide_word;                          -- P * Q

begin

  wanted <= resize(signed('0' & far), wanted'length) - OFFSET;

  reach <= to_signed(LEAST, LENGTH_WIDTH) when wanted < LEAST else
           to_signed(MOST, LENGTH_WIDTH) when wanted > MOST else
           wanted(LENGTH_WIDTH - 1 downto 0);

  folding    <= factor(to_signed(MOST, VECTOR_WIDTH) - reach)
                * factor(resize(reach, VECTOR_WIDTH) + LEAST);
  stretching <= factor(resize(reach, VECTOR_WIDTH) - LEAST)
                * factor(resize(reach, VECTOR_WIDTH) + MOST);
  quarter    <= signed('0' & folded) * signed('0' & stretched);

  rotation : entity work.cordic
    generic map (
      WIDTH       => VECTOR_WIDTH,
      ANGLE_WIDTH => ANGLE_WIDTH,
      GUARD       => GUARD,
      ROTATIONS   => ROTATIONS
    )
    port map (
      clk    => clk,
      rst    => rst,
      start  => turn,
      x      => vector_x,
      y      => vector_y,
      radius => measured,
      angle  => angle,
      busy   => open,
      ready  => rotated
    );

  root_of_product : entity work.square_root
    generic map (
      WIDTH => 2 * LENGTH_WIDTH
    )
    port map (
      clk   => clk,
      rst   => rst,
      start => extract,
      x     => radicand,
      root  => root,
      busy  => open,
      ready => rooted
    );

  process (clk)
    -- Under way: 1, 2 and 6 a vector, 5 the root, 3 and 4 the edges of the products.
    variable pass   : natural range 0 to 6;
    variable height : std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    variable side   : angle_word;
    variable rise   : angle_word;
    variable shown  : length_word;
    variable is_out : std_logic;
  begin
    if rising_edge(clk) then
      turn    <= '0';
      extract <= '0';
      ready   <= '0';

      if start = '1' then
        vector_x <= resized(y);
        vector_y <= negative(x);
        height   := z;
        turn     <= '1';
        busy     <= '1';
        pass     := 1;
      elsif pass = 3 then
        if wanted /= reach then
          is_out := '1';
        end if;
        shown     := reach + OFFSET;
        folded    <= part(folding);
        stretched <= part(stretching);
        pass      := 4;
      elsif pass = 4 then
        vector_x <= std_logic_vector(signed('0' & stretched) - signed('0' & folded));
        radicand <= std_logic_vector(quarter(2 * LENGTH_WIDTH - 3 downto 0)) & "00";
        extract  <= '1';
        pass     := 5;
      elsif pass = 5 then
        if rooted = '1' and extract = '0' then
          vector_y <= '0' & root;
          turn     <= '1';
          pass     := 6;
        end if;
      elsif rotated = '1' and turn = '0' then
        if pass = 1 then
          is_out := '0';
          if limited(angle) /= angle then
            is_out := '1';
          end if;
          side     := limited(angle);
          vector_x <= measured;
          vector_y <= resized(height);
          turn     <= '1';
          pass     := 2;
        elsif pass = 2 then
          if limited(angle) /= angle then
            is_out := '1';
          end if;
          rise   := limited(angle);
          far    <= measured;
          pass   := 3;
        elsif pass = 6 then
          pitch        <= rise;
          roll         <= side;
          crank        <= within_half_turn(angle);
          radius       <= std_logic_vector(shown);
          out_of_reach <= is_out;
          busy         <= '0';
          ready        <= '1';
          pass         := 0;
        end if;
      end if;

      if rst = '1' then
        pass         := 0;
        turn         <= '0';
        extract      <= '0';
        height       := (others => '0');
        vector_x     <= (others => '0');
        vector_y     <= (others => '0');
        side         := (others => '0');
        rise         := (others => '0');
        far          <= (others => '0');
        shown        := (others => '0');
        is_out       := '0';
        folded       <= (others => '0');
        stretched    <= (others => '0');
        radicand     <= (others => '0');
        pitch        <= (others => '0');
        roll         <= (others => '0');
        crank        <= (others => '0');
        radius       <= (others => '0');
        out_of_reach <= '0';
        busy         <= '0';
        ready        <= '0';
      end if;
    end if;
  end process;

end architecture;
